//! Splats from their attributes to the picture on a device, without any read-back in between. One joined recording orders, projects
//! and shades them, resolves the opaque splats, and composites the translucent ones in front. If all casters of shadows are among
//! the splats, it makes their shadows too.
//!
//! The stages know nothing of each other; this module names the buffers that they share. Splats that do not fit the device
//! at once are ordered first and then drawn in parts.

mod parts;
mod shadows;
mod whole;

use crate::trial::shadow_trial;
use crate::{Failure, Helper};
use splat_core::raster::gpu::{Attributes, Capacities, Counts, TILE, project, resolve};
use splat_core::raster::{OpaqueImage, Params, RasterCounts};
use splat_core::shade::{ChannelLayout, ShadeInput, gpu as shade};
use splat_core::{Accumulator, Error, FootprintStack, Progress};
use splat_shaders::{AdapterKind, BufferId, DeviceError, Executor, Lanes, PassTime};
use tsm::gpu::Casting;
use whole::{Rooms, Whole};

/// Splats, and what becomes of them.
#[derive(Clone, Copy)]
pub struct Splats<'a> {
    /// Splats, materials, lights and the camera.
    pub input: &'a ShadeInput<'a>,
    /// The translucent ones.
    pub ids: &'a [u32],
    /// The opaque ones; none where they are resolved.
    pub solid: &'a [u32],
    /// Their footprints.
    pub footprints: &'a FootprintStack,
    /// The numbers that each brings to a pixel.
    pub layout: ChannelLayout,
    /// The order must be exact.
    pub sort: &'a hbsort::Params,
    /// How they are rasterized; sums are in single precision whatever it says.
    pub raster: &'a Params,
    /// The opaque image that hides translucent splats.
    pub opaque: &'a OpaqueImage,
    /// For each light with a shadow what throws it, where all of that happens on the device; else none, and what the lights'
    /// maps let through is uploaded.
    pub castings: &'a [Casting],
    /// Asked whether to stop; not advanced.
    pub progress: &'a Progress,
}

/// Results of a device.
pub struct Chained {
    /// Splats that reach a pixel.
    pub visible: u64,
    /// The work.
    pub raster: RasterCounts,
    /// The opaque splats, where they were among those given.
    pub opaque: Option<OpaqueImage>,
    /// The times of all dispatches.
    pub passes: Vec<PassTime>,
}

/// Why splats do not go through a device all at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reason {
    /// The device's buffers or its memory are too small.
    TooLarge,
    /// A tile has more splats than the driver goes through.
    TooLong,
    /// Discs reach through the eye plane.
    ThroughTheEye,
}

impl Reason {
    /// Said where the processor draws them.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::TooLarge => "the device has no room for even few splats of the picture: the processor draws them",
            Self::TooLong => "a tile has more splats than the software driver goes through: the processor draws them",
            Self::ThroughTheEye => "surfaces through the eye plane are drawn by the processor",
        }
    }
}

/// Room for tile entries before their number is known: so many a splat, and these.
const ENTRIES_OF_SPLAT: usize = 4;
const MORE_ENTRIES: usize = 1 << 16;
/// Splats of a tile that a thread of a software driver goes through: one round each, with some to spare.
const MOST_OF_A_TILE: u64 = 60_000;

/// Room for the tile entries of so many splats, before their number is known.
fn room_for(splats: usize) -> u32 {
    let guess = ENTRIES_OF_SPLAT.saturating_mul(splats).saturating_add(MORE_ENTRIES);
    u32::try_from(guess).unwrap_or(u32::MAX)
}

/// Whether a driver has left splats away: Mesa's on the processor ends the loops of a thread after 65535 rounds, silently.
fn too_long(device: &dyn Executor, counts: &Counts) -> bool {
    device.adapter().kind == AdapterKind::Software && counts.longest > MOST_OF_A_TILE
}

/// The device's counts as the processor's.
fn raster_counts(counts: &Counts, bytes: u64) -> RasterCounts {
    // At most: tiles that are done are left.
    let fragments = counts.entries * u64::from(TILE * TILE);
    RasterCounts { splats: counts.splats, tile_entries: counts.entries, fragments, bytes }
}

/// Orders, projects, shades and composites splats by a device; the accumulator changes only when all is done. `None` where that
/// is the processor's: without a device, where not even few splats fit into it, where discs reach through the eye plane, where footprints
/// are images, each with one line said, and where splats do not fit all at once with what throws their shadows.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn chain(
    helper: &Helper<'_>,
    splats: &Splats<'_>,
    accumulator: &mut Accumulator,
) -> Result<Option<Chained>, Error> {
    if splats.footprints.has_images() {
        helper.leave("splats with images as footprints are drawn by the processor");
        return Ok(None);
    }
    let done = helper.with(|device| match chain_on(device, splats, accumulator) {
        Err(Failure::Splats(Error::Cancelled)) => Ok(Err(Error::Cancelled)),
        done => done.map(Ok),
    });
    match done.transpose()? {
        Some(Err(reason)) if splats.castings.is_empty() => {
            helper.leave(reason.words());
            Ok(None)
        }
        done => Ok(done.and_then(Result::ok)),
    }
}

/// Whether shadow maps may be made and stay where the splats are: whether the device makes the processor's, bit for bit.
pub fn keeps_shadows(helper: &Helper<'_>) -> bool {
    let trial = |device: &mut dyn Executor| match shadow_trial(device) {
        // A device on which not even a trial has room does nothing of the kind.
        Err(Failure::Device(DeviceError::TooLarge { .. } | DeviceError::Memory { .. })) => Ok(false),
        tried => tried,
    };
    helper.with(trial).unwrap_or(false)
}

/// [`Splats`] into an accumulator by a device, which changes only when all is done; or why the processor draws them.
pub(crate) fn chain_on(
    device: &mut dyn Executor,
    splats: &Splats<'_>,
    accumulator: &mut Accumulator,
) -> Result<Result<Chained, Reason>, Failure> {
    let n = splats.ids.len();
    let most = match run_on(device, splats, true, room_for(n), accumulator)? {
        Ok(done) => return Ok(Ok(done)),
        // In parts they would throw their shadows again and again.
        Err(reason) if !splats.castings.is_empty() => return Ok(Err(reason)),
        Err(Reason::ThroughTheEye) => return Ok(Err(Reason::ThroughTheEye)),
        Err(Reason::TooLarge) => n.div_ceil(2),
        Err(Reason::TooLong) => MOST_OF_A_TILE as usize,
    };
    if splats.solid.is_empty() {
        return parts::chain_in_parts(device, splats, most, accumulator);
    }
    // Opaque splats hide those of all parts.
    let mut nothing = accumulator.clone();
    let solid = Splats { ids: &[], ..*splats };
    let first = match run_on(device, &solid, false, 0, &mut nothing)? {
        Ok(first) => first,
        Err(reason) => return Ok(Err(reason)),
    };
    let opaque = first.opaque.unwrap_or_default();
    let translucent = Splats { solid: &[], opaque: &opaque, ..*splats };
    let done = parts::chain_in_parts(device, &translucent, most, accumulator)?;
    Ok(done.map(|mut done| {
        done.visible += first.visible;
        parts::add(&mut done.raster, &first.raster);
        done.passes.splice(..0, first.passes);
        Chained { opaque: Some(opaque), ..done }
    }))
}

/// All splats at once, sorted by the device or in order as they are, with room for so many tile entries at first.
fn run_on(
    device: &mut dyn Executor,
    splats: &Splats<'_>,
    sorts: bool,
    entries: u32,
    accumulator: &mut Accumulator,
) -> Result<Result<Chained, Reason>, Failure> {
    let ids = [splats.ids, splats.solid].concat();
    let attributes = Attributes::new(splats.input.cloud, Some(&ids))?;
    // No more than a kernel sees: whether that is enough the device says.
    let most = u32::try_from(device.adapter().binding_bytes / 4).unwrap_or(u32::MAX);
    let mut rooms = splats.rooms(&attributes, accumulator, entries, most);
    let Some(mut casts) = shadows::rooms(splats.castings, &attributes, device.adapter().binding_bytes) else {
        return Ok(Err(Reason::TooLarge));
    };
    let mut looked_up = None;
    let lanes = Lanes::for_adapter(device.adapter());
    loop {
        let whole = Whole::record(&rooms, &attributes, splats.input, splats.layout, sorts, &casts)?;
        let mut ready = match device.prepare(&whole.recording.by(lanes)) {
            Err(DeviceError::TooLarge { .. } | DeviceError::Memory { .. }) => return Ok(Err(Reason::TooLarge)),
            ready => ready?,
        };
        let received = looked_up.take().map_or_else(|| splats.received(&ids), Ok)?;
        if splats.progress.is_cancelled() {
            return Err(Error::Cancelled.into());
        }
        let run = |inputs: &[(BufferId, &[u8])]| ready.run(inputs).map_err(Failure::from);
        let run = whole.with_inputs(splats, &ids, &attributes, &received, accumulator, run)?;
        let (projected, joined) = &whole.project;
        let projection = run.bytes(joined.buffer(projected.state));
        if project::through_the_eye(projection)? > 0 {
            return Ok(Err(Reason::ThroughTheEye));
        }
        let visible = project::visible(projection)?;
        let had_room = shadows::had_room(&whole.shadows, &run, &mut casts)?;
        // Too little room: found once, for the device says what it needs. Without all shadows it is another picture.
        if !(whole.had_room(&run, &mut rooms)? && had_room) {
            looked_up = Some(received);
            continue;
        }
        let (counts, opaque) = whole.finish(&run, accumulator, |counts| too_long(device, counts))?;
        let Some(counts) = counts else { return Ok(Err(Reason::TooLong)) };
        let raster = raster_counts(&counts, whole.recording.bytes());
        return Ok(Ok(Chained { visible, raster, opaque, passes: run.passes }));
    }
}

impl Splats<'_> {
    /// Returns the transmittances of the lights' maps at these splats, if they are uploaded.
    fn received(&self, ids: &[u32]) -> Result<Vec<[f32; 3]>, Error> {
        if self.castings.is_empty() { shade::received(self.input, ids, Some(self.progress)) } else { Ok(Vec::new()) }
    }

    /// Room for so many entries of translucent splats, and as many as opaque ones may have.
    fn rooms(&self, attributes: &Attributes, accumulator: &Accumulator, entries: u32, most: u32) -> Rooms {
        let size = accumulator.size;
        let channels = accumulator.channels.len() as u32;
        let splats = attributes.room().splats;
        let footprints = self.footprints.layers().len() as u32;
        let solid = !self.solid.is_empty();
        let objects = !accumulator.object.is_empty();
        let composite = Capacities {
            size,
            planes: accumulator.optical_depth.len() as u32,
            channels,
            splats,
            ordered: self.ids.len() as u32,
            entries: entries.min(most),
            footprints,
            materials: self.input.materials.len() as u32,
            opaque: solid || !self.opaque.depth.is_empty(),
            depths: !accumulator.depth.is_empty(),
            objects,
        };
        let listed = self.solid.len() as u32;
        let entries = room_for(self.solid.len()).min(most);
        let resolved = resolve::Capacities { size, channels, splats, listed, entries, footprints, objects };
        Rooms { composite, solid: solid.then_some(resolved) }
    }
}
