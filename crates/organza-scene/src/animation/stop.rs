//! An object that stops on its way, and the way.

use crate::animation::raw::Blend;
use crate::animation::weights::weights;
use crate::shown;
use glam::DVec3;

/// An object that moves until it meets others.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// Its rank.
    pub object: usize,
    /// Its way.
    pub path: Path,
    /// The last frame of the animation.
    pub last: u32,
    /// The frame that the scene is at.
    pub frame: u32,
    /// The light whose shadow map tells what is met.
    pub light: usize,
    /// Names of what may be met; no track changes them or the light.
    pub objects: Vec<String>,
}

impl Stop {
    /// The sentence about a time up to which the object of this name is free.
    pub fn said(&self, name: &str, time: f64) -> Option<String> {
        let name = shown(name);
        let light = self.light;
        let said = format!("object '{name}' stops at frame {time:.2}, where light {light} sees it meet others");
        (time < self.last.into()).then_some(said)
    }
}

/// The places of an object by time, in frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    pub(crate) frames: Vec<f64>,
    pub(crate) places: Vec<DVec3>,
    pub(crate) blend: Blend,
}

impl Path {
    /// The translation of the object's transform at a time, which may lie between two frames.
    pub fn at(&self, time: f64) -> DVec3 {
        let (first, weights) = weights(&self.frames, time, self.blend);
        weights.iter().zip(&self.places[first..]).map(|(w, p)| *w * *p).sum()
    }
}
