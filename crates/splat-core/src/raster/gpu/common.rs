//! The buffers that compositing has however it is done.

use super::{Capacities, Recorded, table_bytes};
use crate::Error;
use splat_shaders::layouts::{SortState, SplatState, SplatView};
use splat_shaders::{BufferId, Groups, Recording, kernels};

/// Inputs, and what is read back.
#[derive(Clone, Copy)]
pub(super) struct Common {
    pub(super) view: BufferId,
    pub(super) order: BufferId,
    pub(super) splats: BufferId,
    pub(super) values: BufferId,
    pub(super) tables: BufferId,
    pub(super) opaque: BufferId,
    pub(super) planes: BufferId,
    pub(super) state: BufferId,
}

impl Common {
    pub(super) fn record(r: &mut Recording, capacities: Capacities) -> Result<Self, Error> {
        capacities.check()?;
        let Capacities { size, channels, splats, ordered, .. } = capacities;
        let area = u64::from(size[0]) * u64::from(size[1]);
        let words = |n: u32| 4 * u64::from(n);
        let objects = if capacities.objects { splats } else { 0 };
        let tables = table_bytes(capacities.footprints, capacities.materials, objects);
        Ok(Self {
            view: r.input("view", size_of::<SplatView>() as u64),
            order: r.input("order", words(ordered)),
            splats: r.input("splats", words(splats) * u64::from(capacities.splat_words())),
            values: r.input("values", words(splats) * u64::from(channels)),
            tables: r.input("tables", tables),
            opaque: r.input("opaque", if capacities.opaque { 4 * area } else { 0 }),
            planes: r.input("planes", 4 * area * u64::from(capacities.planes_of_pixel())),
            state: r.scratch("state", size_of::<SplatState>() as u64),
        })
    }

    /// Where the order is a sort's on the device, its number of splats is put into the view: the state of the sort.
    pub(super) fn follow(self, r: &mut Recording, follows: bool) -> Option<BufferId> {
        let sorted = follows.then(|| r.input("sorted", size_of::<SortState>() as u64))?;
        r.dispatch(&kernels::SPLAT_FOLLOW, Groups::cover(1), &[sorted, self.view], &[]);
        Some(sorted)
    }

    /// Reads back; `counted` is what the state counts, and the room for it.
    pub(super) fn finish(
        self,
        mut recording: Recording,
        capacities: Capacities,
        sorted: Option<BufferId>,
        counted: (&'static str, u32),
    ) -> Recorded {
        let Self { view, order, splats, values, tables, opaque, planes, state } = self;
        recording.read(state);
        recording.read(planes);
        let inputs = [view, order, splats, values, tables, opaque];
        Recorded { recording, capacities, state, planes, splats, order, values, opaque, sorted, inputs, counted }
    }
}
