//! Which splats are drawn, and how: lists that serve all frames of the same splats.

use super::Frame;
use crate::scene::Technique;
use rayon::prelude::*;
use splat_core::{Cloud, SplatKind};
use std::cell::OnceCell;

/// What follows from the splats and the plan alone; each made when it is first asked for.
#[derive(Default)]
pub(crate) struct Lists {
    /// `None` inside where all splats are drawn.
    drawn: OnceCell<Option<Cloud>>,
    /// Opaque ones: those that are drawn as splats, and those that rays meet exactly.
    solid: [OnceCell<Vec<u32>>; 2],
    /// Translucent ones by technique.
    translucent: [OnceCell<Vec<u32>>; Technique::ALL.len()],
}

impl Frame<'_> {
    /// The splats that are drawn as they are: opaque ones, and those of techniques that draw splats. Ids of what is shaded, sorted
    /// and composited are places in this cloud.
    pub fn drawn(&self) -> &Cloud {
        let cloud = &self.loaded.cloud;
        let some = self.lists.drawn.get_or_init(|| {
            let is_own = &self.plan.is_own;
            let draws = &self.plan.draws;
            let is_drawn = |kind, object: usize| (kind == SplatKind::Opaque && !is_own[object]) || draws[object];
            let drawn = splats_of(cloud, is_drawn);
            (drawn.len() < cloud.len()).then(|| cloud.gather(&drawn))
        });
        some.as_ref().unwrap_or(cloud)
    }

    /// Ids of the translucent ones of the drawn splats that are a technique's, ascending; not those of objects that are drawn from
    /// their own data.
    pub fn translucent(&self, technique: Technique) -> &[u32] {
        self.lists.translucent[technique as usize].get_or_init(|| self.translucent_in(self.drawn(), technique))
    }

    /// The same of another cloud.
    pub(crate) fn translucent_in(&self, cloud: &Cloud, technique: Technique) -> Vec<u32> {
        let takes: Vec<bool> =
            self.plan.by.iter().zip(&self.plan.is_own).map(|(by, is_own)| *by == technique && !is_own).collect();
        splats_of(cloud, |kind, object| kind != SplatKind::Opaque && takes[object])
    }

    /// The opaque splats that are drawn as such.
    pub(crate) fn solid_ids(&self) -> &[u32] {
        self.solid_of(false)
    }

    /// Whether all that is opaque is.
    pub(crate) fn draws_all_solid(&self) -> bool {
        self.solid_of(true).is_empty() && !self.has_polygons()
    }

    /// Whether any triangles stay triangles.
    pub(super) fn has_polygons(&self) -> bool {
        self.loaded.own.iter().any(|native| native.form.is_polygons())
    }

    /// The opaque ones of the drawn splats, those that rays meet exactly, or the others.
    pub(super) fn solid_of(&self, exact: bool) -> &[u32] {
        let are = &self.plan.exact;
        self.lists.solid[usize::from(exact)]
            .get_or_init(|| splats_of(self.drawn(), |kind, object| kind == SplatKind::Opaque && are[object] == exact))
    }
}

/// Ids of the splats of a cloud whose kind and object are some, ascending.
fn splats_of(cloud: &Cloud, are: impl Fn(SplatKind, usize) -> bool + Sync) -> Vec<u32> {
    let is_one = |i: &u32| are(cloud.kind[*i as usize], cloud.object[*i as usize] as usize);
    (0..cloud.len() as u32).into_par_iter().with_min_len(1 << 14).filter(is_one).collect()
}
