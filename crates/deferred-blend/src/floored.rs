//! The paper's transparency, for comparison with layers that gaps separate: groups of discs, depths floored to steps (section 5.2).
//!
//! In a group discs do not overlap on a surface, so a pixel meets at most one disc of each layer. If it meets two in one step of depth,
//! the farther disc was drawn first and the nearer one fails the depth test: it neither hides anything nor is seen. A surface
//! that crosses the end of a step attenuates twice there.

use crate::disc::Ray;
use crate::fragments::Fragment;
use crate::grouping::Groups;
use crate::layer::Layer;
use crate::layers::GapRule;
use crate::{BlendInput, Error};
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};

/// Groups, and steps of depth.
#[derive(Debug, Clone, Copy)]
pub struct Floors<'a> {
    /// The group of each disc of the cloud.
    pub groups: &'a Groups,
    /// n of Eq. 10, ≥ 1.
    pub steps: u32,
}

/// The rule that forms a pixel's layers from its discs.
#[derive(Debug, Clone, Copy, Default)]
pub enum Layering<'a> {
    /// Layers are told apart by gaps in depth, each is averaged, all are composited.
    #[default]
    Gaps,
    /// The same for so many nearest layers, ≥ 1: depth peeling.
    Peeled(u32),
    /// Algorithm 1: in each group the discs are composited, one a step of depth; the images of all groups are averaged.
    Algorithm1(Floors<'a>),
    /// Algorithm 2: the nearest layer is averaged by weight (Eq. 1), before the rest as Algorithm 1 has it.
    Algorithm2(Floors<'a>),
}

impl Layering<'_> {
    /// Whether its numbers are in range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let (name, number) = match self {
            Self::Gaps => return Ok(()),
            Self::Peeled(layers) => ("number of peeled layers", *layers),
            Self::Algorithm1(floors) | Self::Algorithm2(floors) => ("number of steps of depth", floors.steps),
        };
        if number == 0 { Err(Error::parameter(name, number, "at least 1")) } else { Ok(()) }
    }
}

/// Values and transmittance of a pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Blended {
    /// Values times opacity.
    pub(crate) values: [f32; MAX_CHANNELS],
    /// Transmittance by plane.
    pub(crate) through: [f32; 3],
}

impl Blended {
    const NOTHING: Self = Self { values: [0.0; MAX_CHANNELS], through: [1.0; 3] };

    /// Something nearer, in front of it.
    fn behind(&mut self, values: &[f32; MAX_CHANNELS], opacity: [f32; 3], sizes: [usize; 2]) {
        let [planes, channels] = sizes;
        for (c, sum) in self.values.iter_mut().enumerate().take(channels) {
            *sum = values[c] + (1.0 - opacity[ChannelLayout::plane_of(c, channels, planes)]) * *sum;
        }
        for (through, opacity) in self.through.iter_mut().zip(opacity).take(planes) {
            *through *= 1.0 - opacity;
        }
    }
}

/// The floored depths of a view.
pub(crate) struct Floor<'a> {
    groups: &'a Groups,
    /// Whether the nearest layer is averaged by weight.
    smooths_nearest: bool,
    near: f32,
    per_depth: f32,
    steps: f32,
}

impl<'a> Floor<'a> {
    /// Eq. 10 between the depths of the nearest and the farthest disc; `None` where depths are not floored.
    ///
    /// The farthest disc belongs to the last step, not to one behind it.
    pub(crate) fn new(layering: &Layering<'a>, range: [f32; 2]) -> Option<Self> {
        let [near, far] = range;
        let (floors, smooths_nearest) = match layering {
            Layering::Gaps | Layering::Peeled(_) => return None,
            Layering::Algorithm1(floors) => (floors, false),
            Layering::Algorithm2(floors) => (floors, true),
        };
        let steps = floors.steps as f32;
        let per_depth = if far > near { steps / (far - near) } else { 0.0 };
        Some(Self { groups: floors.groups, smooths_nearest, near, per_depth, steps })
    }

    fn step(&self, depth: f32) -> f32 {
        ((depth - self.near) * self.per_depth).floor().clamp(0.0, self.steps - 1.0)
    }

    /// A pixel, whose fragments lie near to far.
    pub(crate) fn blend(
        &self,
        fragments: &[Fragment],
        input: &BlendInput<'_>,
        rule: GapRule,
        ray: &Ray,
        sizes: [usize; 2],
    ) -> Blended {
        let Some(nearest) = fragments.first().filter(|_| self.smooths_nearest) else {
            return algorithm_1(fragments, input, self, ray, sizes);
        };
        // The conservative test of Fig. 6: within ε of the nearest, not of a neighbour.
        let end = fragments.iter().position(|f| !rule.joins(input.discs, nearest, f)).unwrap_or(fragments.len());
        // I = α·C_F + (1 − α)·C_O
        let mut blended = algorithm_1(&fragments[end..], input, self, ray, sizes);
        let front = Layer::from_fragments(&fragments[..end], input, ray, sizes);
        blended.behind(&front.values, front.opacity, sizes);
        blended
    }
}

/// A pixel by Algorithm 1: the mean of the images of all groups. Its fragments lie near to far.
fn algorithm_1(
    fragments: &[Fragment],
    input: &BlendInput<'_>,
    floor: &Floor<'_>,
    ray: &Ray,
    sizes: [usize; 2],
) -> Blended {
    let [planes, channels] = sizes;
    let count = floor.groups.count();
    let mut sum = Blended { values: [0.0; MAX_CHANNELS], through: [0.0; 3] };
    for group in 0..count {
        let mut image = Blended::NOTHING;
        let mut last = f32::INFINITY;
        let is_member = |f: &&Fragment| floor.groups.has(input.discs.ids[f.disc as usize] as usize, group);
        for fragment in fragments.iter().filter(is_member).rev() {
            let step = floor.step(fragment.depth);
            if step < last {
                last = step;
                let shown = Layer::from_fragments(std::slice::from_ref(fragment), input, ray, sizes);
                image.behind(&shown.values, shown.opacity, sizes);
            }
        }
        sum.values.iter_mut().zip(image.values).take(channels).for_each(|(sum, v)| *sum += v);
        sum.through.iter_mut().zip(image.through).take(planes).for_each(|(sum, t)| *sum += t);
    }
    let share = 1.0 / count as f32;
    Blended { values: sum.values.map(|v| v * share), through: sum.through.map(|t| t * share) }
}
