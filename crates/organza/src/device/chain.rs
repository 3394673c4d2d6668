//! Translucent splats from their attributes to the picture on a device, with nothing read back between: ordered, projected,
//! shaded and composited by one joined recording; where all that throws shadows is among them, their shadows are made there too.
//!
//! The stages know nothing of each other; the buffers that they have in common are named here. Splats that the device does not
//! take all at once go through it in parts, ordered before.

mod parts;
mod shadows;

use super::Failure;
use super::splats::{MOST_OF_A_TILE, raster_counts, room_for, too_long};
use hbsort::gpu as order;
use shadows::Shadow;
use splat_core::raster::gpu::{Attributes, Capacities, follow, project, record};
use splat_core::raster::{OpaqueImage, Params, RasterCounts};
use splat_core::shade::{ChannelLayout, ShadeInput, gpu as shade};
use splat_core::{Accumulator, Error, FootprintStack, Progress};
use splat_shaders::{BufferId, DeviceError, Executor, Joined, PassTime, Recording};
use tsm::gpu::{CastRoom, Casting};

/// Translucent splats, and what becomes of them.
pub(crate) struct Translucent<'a> {
    /// Splats, materials, lights and the camera.
    pub(crate) input: &'a ShadeInput<'a>,
    /// The translucent ones.
    pub(crate) ids: &'a [u32],
    pub(crate) footprints: &'a FootprintStack,
    pub(crate) layout: ChannelLayout,
    /// The order must be exact.
    pub(crate) sort: &'a hbsort::Params,
    pub(crate) raster: &'a Params,
    pub(crate) opaque: &'a OpaqueImage,
    /// For each light with a shadow what throws it, where all of that happens on the device; else none, and what the lights'
    /// maps let through is uploaded.
    pub(crate) castings: &'a [Casting],
    pub(crate) progress: &'a Progress,
}

/// What a device did.
pub(crate) struct Chained {
    /// Splats that reach a pixel.
    pub(crate) visible: u64,
    pub(crate) raster: RasterCounts,
    pub(crate) passes: Vec<PassTime>,
}

/// How it went with splats all at once.
enum Outcome {
    Done(Chained),
    /// The device's buffers or its memory are too small.
    TooLarge,
    /// A tile has more splats than the driver goes through.
    TooLong,
}

/// The recordings of the stages as one.
struct Whole {
    recording: Recording,
    /// None where the splats are in order.
    sort: Option<order::Recorded>,
    project: (project::Recorded, Joined),
    /// Of each light with a shadow.
    shadows: Vec<Shadow>,
    shade: (shade::Recorded, Joined),
    composite: (splat_core::raster::gpu::Recorded, Joined),
}

impl Whole {
    fn record(
        room: Capacities,
        attributes: &Attributes,
        input: &ShadeInput<'_>,
        layout: ChannelLayout,
        sorts: bool,
        casts: &[CastRoom],
    ) -> Result<Self, Error> {
        let splats = room.splats;
        let sort = sorts.then(|| order::record(order::Capacities { splats, kept: splats }));
        let (attributes, footprints, materials) = (attributes.room(), room.footprints, room.materials);
        let projected = project::record(project::Capacities { attributes, footprints, materials, depth: room.opaque })?;
        let shaded = shade::record(shade::Capacities::of(input, attributes, layout));
        let composite = if sorts { follow::record(room)? } else { record(room)? };
        let mut recording = sort.as_ref().map_or_else(Recording::default, |sort| sort.recording.clone());
        let at = &projected.attributes;
        let positions: Vec<_> =
            sort.iter().flat_map(|sort| [(at.positions, sort.positions), (at.radii, sort.radii)]).collect();
        let in_project = recording.join(&projected.recording, &positions);
        let at = at.of(&in_project);
        let shadows = shadows::join(&mut recording, casts, &at);
        let received = shadows.first().map(|(shadow, joined)| (shaded.received, joined.of(shadow.received)));
        let known: Vec<_> = shaded.attributes.shared(&at).into_iter().chain(received).collect();
        let in_shade = recording.join(&shaded.recording, &known);
        let mut taken =
            vec![(composite.splats, in_project.of(projected.splats)), (composite.values, in_shade.of(shaded.values))];
        if let (Some(sort), Some(sorted)) = (&sort, composite.sorted) {
            taken.extend([(composite.order, sort.places), (sorted, sort.state)]);
        }
        let in_composite = recording.join(&composite.recording, &taken);
        let read =
            [in_project.of(projected.state), in_composite.of(composite.state), in_composite.of(composite.planes)];
        let of_shadows = shadows.iter().map(|(shadow, joined)| joined.of(shadow.cast.state));
        recording.read_only(&read.into_iter().chain(of_shadows).collect::<Vec<_>>());
        Ok(Self {
            recording,
            sort,
            project: (projected, in_project),
            shadows,
            shade: (shaded, in_shade),
            composite: (composite, in_composite),
        })
    }
}

/// [`Translucent`] splats into an accumulator by a device, which changes only when all is done; `None` where it takes not even
/// few of them, or not all at once with their shadows.
pub(super) fn chain_on(
    device: &mut dyn Executor,
    splats: &Translucent<'_>,
    accumulator: &mut Accumulator,
) -> Result<Option<Chained>, Failure> {
    let n = splats.ids.len();
    let most = match run_on(device, splats, true, room_for(n), accumulator)? {
        Outcome::Done(done) => return Ok(Some(done)),
        // In parts they would throw their shadows again and again.
        _ if !splats.castings.is_empty() => return Ok(None),
        Outcome::TooLarge => n.div_ceil(2),
        Outcome::TooLong => MOST_OF_A_TILE as usize,
    };
    parts::chain_in_parts(device, splats, most, accumulator)
}

/// All splats at once, sorted by the device or in order as they are, with room for so many tile entries at first.
fn run_on(
    device: &mut dyn Executor,
    splats: &Translucent<'_>,
    sorts: bool,
    room: u32,
    accumulator: &mut Accumulator,
) -> Result<Outcome, Failure> {
    let attributes = Attributes::new(splats.input.cloud, Some(splats.ids))?;
    let mut capacities = Capacities {
        size: accumulator.size,
        planes: accumulator.optical_depth.len() as u32,
        channels: accumulator.channels.len() as u32,
        splats: attributes.room().splats,
        ordered: attributes.room().splats,
        // No more than a kernel sees: whether that is enough the device says.
        entries: room.min(u32::try_from(device.adapter().binding_bytes / 4).unwrap_or(u32::MAX)),
        footprints: splats.footprints.layers().len() as u32,
        materials: splats.input.materials.len() as u32,
        opaque: !splats.opaque.depth.is_empty(),
    };
    let Some(mut casts) = shadows::rooms(splats.castings, &attributes, device.adapter().binding_bytes) else {
        return Ok(Outcome::TooLarge);
    };
    let mut looked_up = None;
    loop {
        let whole = Whole::record(capacities, &attributes, splats.input, splats.layout, sorts, &casts)?;
        let mut ready = match device.prepare(&whole.recording) {
            Err(DeviceError::TooLarge { .. } | DeviceError::Memory { .. }) => return Ok(Outcome::TooLarge),
            ready => ready?,
        };
        let received = looked_up.take().unwrap_or_else(|| splats.received());
        if splats.progress.is_cancelled() {
            return Err(Error::Cancelled.into());
        }
        let run = |inputs: &[(BufferId, &[u8])]| ready.run(inputs).map_err(Failure::from);
        let run = whole.with_inputs(splats, &attributes, &received, accumulator, run)?;
        let (composite, joined) = &whole.composite;
        let bytes = |buffer| run.bytes(joined.of(buffer));
        let fits = shadows::had_room(&whole.shadows, &run, &mut casts)?;
        match composite.counts(bytes(composite.state)) {
            // Too little room: found once, for the device says what it needs.
            Err(Error::Overflow { needed, .. }) if u32::try_from(needed).is_ok_and(|n| n > capacities.entries) => {
                capacities.entries = needed as u32;
                looked_up = Some(received);
            }
            // Without all shadows it is another picture.
            _ if !fits => looked_up = Some(received),
            counts => {
                let counts = counts?;
                if too_long(device, &counts) {
                    return Ok(Outcome::TooLong);
                }
                composite.finish([bytes(composite.state), bytes(composite.planes)], accumulator)?;
                let raster = raster_counts(&counts, whole.recording.bytes());
                let (projected, joined) = &whole.project;
                let visible = project::visible(run.bytes(joined.of(projected.state)))?;
                return Ok(Outcome::Done(Chained { visible, raster, passes: run.passes }));
            }
        }
    }
}

impl Translucent<'_> {
    /// What the maps of the lights let through, where it is uploaded.
    fn received(&self) -> Vec<[f32; 3]> {
        if self.castings.is_empty() { shade::received(self.input, self.ids, self.progress) } else { Vec::new() }
    }
}

impl Whole {
    /// Hands the inputs of all stages to `run`.
    fn with_inputs<T>(
        &self,
        splats: &Translucent<'_>,
        attributes: &Attributes,
        received: &[[f32; 3]],
        accumulator: &Accumulator,
        run: impl FnOnce(&[(BufferId, &[u8])]) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let Translucent { input, footprints, raster, opaque, sort, .. } = *splats;
        let (origin, camera, materials) = (input.cloud.origin, input.camera, input.materials);
        let count = attributes.room().splats;
        let view = order::view_bytes(origin, count, camera, sort);
        // Where nothing sorts they come in their order.
        let order: Vec<u32> = if self.sort.is_some() { Vec::new() } else { (0..count).collect() };
        let ((projected, in_project), (shaded, in_shade), (composite, in_composite)) =
            (&self.project, &self.shade, &self.composite);
        let to = project::Input { origin, camera, footprints, materials, params: raster };
        let project = projected.uploads(&to, attributes)?;
        let shade = if self.shadows.is_empty() {
            shaded.uploads(input, attributes, received)?
        } else {
            shaded.uploads_beside_light(input, attributes)?
        };
        let shares = shade::shadow_shares(input, splats.ids);
        let cast = shadows::uploads(&self.shadows, splats.castings, splats.ids, &shares)?;
        let direction = sort.direction;
        let into = follow::Input { camera, footprints, materials, opaque, direction, params: raster, order: &order };
        let composited = follow::uploads(composite, &into, accumulator)?;
        let mut inputs: Vec<(BufferId, &[u8])> = self.sort.iter().map(|sort| (sort.view, &view[..])).collect();
        inputs.extend(in_project.inputs(attributes.inputs(&projected.attributes)));
        inputs.extend(in_project.inputs(projected.inputs(&project)));
        for ((shadow, joined), uploads) in self.shadows.iter().zip(&cast) {
            inputs.extend(joined.inputs(shadow.inputs(uploads)));
        }
        inputs.extend(in_shade.inputs(shaded.inputs(&shade)));
        inputs.extend(in_composite.inputs(composite.inputs(&composited)));
        // What another stage leaves on the device is not uploaded.
        inputs.retain(|(_, bytes)| !bytes.is_empty());
        run(&inputs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DVec3, Vec3};
    use splat_core::{Camera, Cloud, Material, Projection, Splat};
    use splat_shaders::Step;

    #[test]
    fn attributes_are_uploaded_once_and_the_picture_alone_is_large_of_what_comes_back() {
        let mut cloud = Cloud::new(DVec3::ZERO);
        (0..3000).for_each(|i| cloud.push(&Splat { position: Vec3::X * i as f32, ..Splat::default() }));
        let (size, view) = ([64, 48], Projection::Perspective { fov_y: 1.0 });
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, view, size).expect("a camera");
        let (materials, objects) = ([Material::default()], []);
        let input = ShadeInput {
            cloud: &cloud,
            materials: &materials,
            objects: &objects,
            lights: &[],
            ambient: [0.0; 3],
            camera: &camera,
        };
        let attributes = Attributes::new(&cloud, None).expect("few splats");
        let room = Capacities {
            size,
            planes: 1,
            channels: 3,
            splats: 3000,
            ordered: 3000,
            entries: 5000,
            footprints: 3,
            materials: 1,
            opaque: false,
        };
        let whole = Whole::record(room, &attributes, &input, ChannelLayout::default(), true, &[]).expect("a recording");
        whole.recording.check().expect("no fault");
        let steps = |of: fn(&Step) -> Option<BufferId>| -> Vec<&str> {
            let buffers = whole.recording.buffers();
            whole.recording.steps().iter().filter_map(of).map(|b| buffers[b.index()].name).collect()
        };
        let uploads = steps(|step| if let Step::Upload(b) = step { Some(*b) } else { None });
        let expected = [
            ["view", "positions", "radii", "project view", "looks", "frames", "project tables"],
            ["shade view", "shade tables", "received", "view", "tables", "opaque", "planes"],
        ];
        assert_eq!(uploads, expected.concat());
        assert_eq!(
            steps(|step| if let Step::Read(b) = step { Some(*b) } else { None }),
            ["projected", "state", "planes"]
        );
        // Sorted before, its order is an upload; there is nothing else to it.
        let given =
            Whole::record(room, &attributes, &input, ChannelLayout::default(), false, &[]).expect("a recording");
        given.recording.check().expect("no fault");
        assert!(given.sort.is_none() && given.composite.0.sorted.is_none());
        // Attributes of 40 bytes, a key, and what is sorted, projected, shaded, counted; entries.
        assert!(whole.recording.bytes() < 3000 * 140 + 5000 * 16 + 64 * 48 * 16 + (64 << 10));
    }
}
