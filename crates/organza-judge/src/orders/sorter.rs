//! The orderings, and what each takes to make.

use hbsort::comparison::{CentreKey, as_given, by_centre};
use hbsort::{Params, Scratch, Thickness, slice_cloud};
use organza::{Error, Loaded};
use reference::statistics::{Spread, median_with_spread};
use splat_core::{Camera, Direction, SliceOrder};
use std::time::Instant;

/// How splats are put in order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Ordering {
    /// Slices with exact order inside.
    Exact,
    /// Slices of a thickness, in the scale of the cloud.
    Slices(f64),
    /// One comparison sort by the view depth of centres.
    Centre,
    /// One comparison sort by the distance of centres from the camera.
    Distance,
    /// As the splats lie in memory.
    Unsorted,
}

impl Ordering {
    pub(super) fn name(self, auto: f64) -> String {
        match self {
            Self::Exact => "slices, exact inside".into(),
            Self::Slices(t) => format!("slices, {} x thickness", (t / auto).round()),
            Self::Centre => "comparison sort by view depth".into(),
            Self::Distance => "comparison sort by camera distance".into(),
            Self::Unsorted => "unsorted".into(),
        }
    }

    pub(super) fn thickness(self) -> Option<f64> {
        match self {
            Self::Slices(t) => Some(t),
            _ => None,
        }
    }
}

/// Puts the translucent splats of a scene in order.
pub(super) struct Sorter<'a> {
    pub(super) loaded: &'a Loaded,
    pub(super) camera: Camera,
    pub(super) translucent: Vec<u32>,
    pub(super) margin_px: f64,
    /// Timed repeats of each ordering.
    pub(super) repeats: usize,
}

impl Sorter<'_> {
    /// The order, seconds of the repeats, and bytes.
    pub(super) fn timed(&self, ordering: Ordering) -> Result<(SliceOrder, Option<Spread>, u64), Error> {
        let mut seconds = Vec::new();
        let mut order = SliceOrder::default();
        for _ in 0..self.repeats {
            let start = Instant::now();
            order = match ordering {
                Ordering::Exact => self.slices(Thickness::Auto, true)?,
                Ordering::Slices(t) => self.slices(Thickness::World(t), false)?,
                Ordering::Centre => self.by_centre(CentreKey::Depth),
                Ordering::Distance => self.by_centre(CentreKey::Distance),
                Ordering::Unsorted => as_given(self.translucent.clone()),
            };
            seconds.push(start.elapsed().as_secs_f64());
        }
        let n = self.translucent.len() as u64;
        let bytes = match ordering {
            // The result, and a key of eight bytes beside each id while it is sorted.
            Ordering::Centre | Ordering::Distance => 4 * n + 16 * n,
            Ordering::Unsorted => 4 * n,
            _ => order.bytes() + self.scratch_bytes(ordering)?,
        };
        Ok((order, median_with_spread(&seconds), bytes))
    }

    fn params(&self, thickness: Thickness, exact: bool) -> Params {
        Params { direction: Direction::FrontToBack, thickness, exact, margin_px: self.margin_px, ..Params::default() }
    }

    pub(super) fn slices(&self, thickness: Thickness, exact: bool) -> Result<SliceOrder, Error> {
        let params = self.params(thickness, exact);
        let mut scratch = Scratch::default();
        slice_cloud(&self.loaded.cloud, Some(&self.translucent), &self.camera, &params, &mut scratch)
            .map_err(|e| Error::Internal(e.to_string()))
    }

    fn scratch_bytes(&self, ordering: Ordering) -> Result<u64, Error> {
        let thickness = ordering.thickness().map_or(Thickness::Auto, Thickness::World);
        let params = self.params(thickness, ordering == Ordering::Exact);
        let mut scratch = Scratch::default();
        slice_cloud(&self.loaded.cloud, Some(&self.translucent), &self.camera, &params, &mut scratch)
            .map_err(|e| Error::Internal(e.to_string()))?;
        Ok(scratch.info().bytes)
    }

    /// Culling is left to the rasterizer.
    fn by_centre(&self, key: CentreKey) -> SliceOrder {
        by_centre(&self.loaded.cloud, &self.translucent, &self.camera, key)
    }
}
