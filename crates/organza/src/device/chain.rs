//! Splats from their attributes to the picture on a device, with nothing read back between: ordered, projected, shaded, the
//! opaque ones resolved and the translucent ones composited in front of them by one joined recording; where all that throws
//! shadows is among them, their shadows are made there too.
//!
//! The stages know nothing of each other; the buffers that they have in common are named here. Splats that the device does not
//! take all at once go through it in parts, ordered before.

mod parts;
mod shadows;

use super::Failure;
use super::splats::{MOST_OF_A_TILE, raster_counts, room_for, too_long};
use hbsort::gpu as order;
use shadows::Shadow;
use splat_core::raster::gpu::{Attributes, Capacities, Counts, follow, project, record, resolve};
use splat_core::raster::{OpaqueImage, Params, RasterCounts};
use splat_core::shade::{ChannelLayout, ShadeInput, gpu as shade};
use splat_core::{Accumulator, Error, FootprintStack, Progress};
use splat_shaders::{BufferId, DeviceError, Executor, Joined, Lanes, PassTime, Recording, Run};
use tsm::gpu::{CastRoom, Casting};

/// Splats, and what becomes of them.
#[derive(Clone, Copy)]
pub(crate) struct Splats<'a> {
    /// Splats, materials, lights and the camera.
    pub(crate) input: &'a ShadeInput<'a>,
    /// The translucent ones.
    pub(crate) ids: &'a [u32],
    /// The opaque ones; none where they are resolved.
    pub(crate) solid: &'a [u32],
    pub(crate) footprints: &'a FootprintStack,
    pub(crate) layout: ChannelLayout,
    /// The order must be exact.
    pub(crate) sort: &'a hbsort::Params,
    pub(crate) raster: &'a Params,
    /// What hides translucent splats, where opaque ones are resolved.
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
    /// The opaque splats, where they were among those given.
    pub(crate) opaque: Option<OpaqueImage>,
    pub(crate) passes: Vec<PassTime>,
}

/// How it went with splats all at once.
enum Outcome {
    Done(Chained),
    /// The device's buffers or its memory are too small.
    TooLarge,
    /// A tile has more splats than the driver goes through.
    TooLong,
    /// Discs reach through the eye plane.
    ThroughTheEye,
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
    /// None where there are no opaque splats, or they are resolved.
    resolve: Option<(resolve::Recorded, Joined)>,
    composite: (splat_core::raster::gpu::Recorded, Joined),
}

/// Room for all splats and for the opaque ones.
struct Rooms {
    all: Capacities,
    solid: Option<resolve::Capacities>,
}

impl Whole {
    fn record(
        rooms: &Rooms,
        attributes: &Attributes,
        input: &ShadeInput<'_>,
        layout: ChannelLayout,
        sorts: bool,
        casts: &[CastRoom],
    ) -> Result<Self, Error> {
        let room = rooms.all;
        // The translucent ones come first.
        let sorted = order::Capacities { splats: room.ordered, kept: room.ordered };
        let sort = sorts.then(|| order::record(sorted));
        let (attributes, footprints, materials) = (attributes.room(), room.footprints, room.materials);
        let projected =
            project::record(project::Capacities { attributes, footprints, materials, depth: room.needs_depth() })?;
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
        let mut resolve = None;
        if let Some(solid) = rooms.solid {
            let resolved = resolve::record(solid)?;
            let known =
                [(resolved.splats, in_project.of(projected.splats)), (resolved.values, in_shade.of(shaded.values))];
            let joined = recording.join(&resolved.recording, &known);
            resolve = Some((resolved, joined));
        }
        let mut taken =
            vec![(composite.splats, in_project.of(projected.splats)), (composite.values, in_shade.of(shaded.values))];
        if let (Some(sort), Some(sorted)) = (&sort, composite.sorted) {
            taken.extend([(composite.order, sort.places), (sorted, sort.state)]);
        }
        taken.extend(resolve.iter().map(|(resolved, joined)| (composite.opaque, joined.of(resolved.image))));
        let in_composite = recording.join(&composite.recording, &taken);
        let read =
            [in_project.of(projected.state), in_composite.of(composite.state), in_composite.of(composite.planes)];
        let of_shadows = shadows.iter().map(|(shadow, joined)| joined.of(shadow.cast.state));
        let of_solid = resolve.iter().flat_map(|(r, joined)| [r.state, r.image].map(|buffer| joined.of(buffer)));
        recording.read_only(&read.into_iter().chain(of_shadows).chain(of_solid).collect::<Vec<_>>());
        Ok(Self {
            recording,
            sort,
            project: (projected, in_project),
            shadows,
            shade: (shaded, in_shade),
            resolve,
            composite: (composite, in_composite),
        })
    }
}

/// [`Splats`] into an accumulator by a device, which changes only when all is done; `None` where it takes not even few of them,
/// or not all at once with their shadows.
pub(super) fn chain_on(
    device: &mut dyn Executor,
    splats: &Splats<'_>,
    accumulator: &mut Accumulator,
) -> Result<Option<Chained>, Failure> {
    let n = splats.ids.len();
    let most = match run_on(device, splats, true, room_for(n), accumulator)? {
        Outcome::Done(done) => return Ok(Some(done)),
        // In parts they would throw their shadows again and again.
        _ if !splats.castings.is_empty() => return Ok(None),
        // Surfaces there are composited by the processor.
        Outcome::ThroughTheEye => return Ok(None),
        Outcome::TooLarge => n.div_ceil(2),
        Outcome::TooLong => MOST_OF_A_TILE as usize,
    };
    if splats.solid.is_empty() {
        return parts::chain_in_parts(device, splats, most, accumulator);
    }
    // Opaque splats hide those of all parts.
    let mut nothing = accumulator.clone();
    let solid = Splats { ids: &[], ..*splats };
    let Outcome::Done(Chained { visible, raster, opaque: Some(opaque), passes }) =
        run_on(device, &solid, false, 0, &mut nothing)?
    else {
        return Ok(None);
    };
    let translucent = Splats { solid: &[], opaque: &opaque, ..*splats };
    let Some(mut done) = parts::chain_in_parts(device, &translucent, most, accumulator)? else { return Ok(None) };
    done.visible += visible;
    parts::add(&mut done.raster, &raster);
    done.passes.splice(..0, passes);
    done.opaque = Some(opaque);
    Ok(Some(done))
}

/// All splats at once, sorted by the device or in order as they are, with room for so many tile entries at first.
fn run_on(
    device: &mut dyn Executor,
    splats: &Splats<'_>,
    sorts: bool,
    entries: u32,
    accumulator: &mut Accumulator,
) -> Result<Outcome, Failure> {
    let all = [splats.ids, splats.solid].concat();
    let attributes = Attributes::new(splats.input.cloud, Some(&all))?;
    // No more than a kernel sees: whether that is enough the device says.
    let most = u32::try_from(device.adapter().binding_bytes / 4).unwrap_or(u32::MAX);
    let mut rooms = splats.rooms(&attributes, accumulator, entries, most);
    let Some(mut casts) = shadows::rooms(splats.castings, &attributes, device.adapter().binding_bytes) else {
        return Ok(Outcome::TooLarge);
    };
    let (mut looked_up, lanes) = (None, Lanes::of(device.adapter()));
    loop {
        let whole = Whole::record(&rooms, &attributes, splats.input, splats.layout, sorts, &casts)?;
        let mut ready = match device.prepare(&whole.recording.by(lanes)) {
            Err(DeviceError::TooLarge { .. } | DeviceError::Memory { .. }) => return Ok(Outcome::TooLarge),
            ready => ready?,
        };
        let received = looked_up.take().map_or_else(|| splats.received(&all), Ok)?;
        if splats.progress.is_cancelled() {
            return Err(Error::Cancelled.into());
        }
        let run = |inputs: &[(BufferId, &[u8])]| ready.run(inputs).map_err(Failure::from);
        let run = whole.with_inputs(splats, &all, &attributes, &received, accumulator, run)?;
        let (projected, joined) = &whole.project;
        let projection = run.bytes(joined.of(projected.state));
        if project::through_the_eye(projection)? > 0 {
            return Ok(Outcome::ThroughTheEye);
        }
        let visible = project::visible(projection)?;
        let had_room = shadows::had_room(&whole.shadows, &run, &mut casts)?;
        // Too little room: found once, for the device says what it needs. Without all shadows it is another picture.
        if !(whole.had_room(&run, &mut rooms)? && had_room) {
            looked_up = Some(received);
            continue;
        }
        let (counts, opaque) = whole.finish(&run, accumulator, |counts| too_long(device, counts))?;
        let Some(counts) = counts else { return Ok(Outcome::TooLong) };
        let raster = raster_counts(&counts, whole.recording.bytes());
        return Ok(Outcome::Done(Chained { visible, raster, opaque, passes: run.passes }));
    }
}

impl Splats<'_> {
    /// What the maps of the lights let through to these splats, where it is uploaded.
    fn received(&self, all: &[u32]) -> Result<Vec<[f32; 3]>, splat_core::Error> {
        if self.castings.is_empty() { shade::received(self.input, all, Some(self.progress)) } else { Ok(Vec::new()) }
    }

    /// Room for so many entries of translucent splats, and as many as opaque ones may have.
    fn rooms(&self, attributes: &Attributes, accumulator: &Accumulator, entries: u32, most: u32) -> Rooms {
        let (size, channels, splats) = (accumulator.size, accumulator.channels.len() as u32, attributes.room().splats);
        let footprints = self.footprints.layers().len() as u32;
        let (solid, objects) = (!self.solid.is_empty(), !accumulator.object.is_empty());
        let all = Capacities {
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
        let (listed, entries) = (self.solid.len() as u32, room_for(self.solid.len()).min(most));
        let resolved = resolve::Capacities { size, channels, splats, listed, entries, footprints, objects };
        Rooms { all, solid: solid.then_some(resolved) }
    }
}

impl Whole {
    /// Whether all entries had room; those that had not get what they need.
    fn had_room(&self, run: &Run, rooms: &mut Rooms) -> Result<bool, Failure> {
        let (composite, joined) = &self.composite;
        let mut had = grown(composite.counts(run.bytes(joined.of(composite.state))), &mut rooms.all.entries)?;
        if let (Some((resolved, joined)), Some(solid)) = (&self.resolve, &mut rooms.solid) {
            had &= grown(resolved.counts(run.bytes(joined.of(resolved.state))), &mut solid.entries)?;
        }
        Ok(had)
    }

    /// Takes what was read back, if nothing was `too_long` for the device, and gives counts of all splats.
    fn finish(
        &self,
        run: &Run,
        accumulator: &mut Accumulator,
        too_long: impl Fn(&Counts) -> bool,
    ) -> Result<(Option<Counts>, Option<OpaqueImage>), Failure> {
        let (composite, joined) = &self.composite;
        let bytes = |buffer| run.bytes(joined.of(buffer));
        let mut counts = composite.counts(bytes(composite.state))?;
        let mut opaque = None;
        if let Some((resolved, joined)) = &self.resolve {
            let (image, of_solid) =
                resolved.finish([resolved.state, resolved.image].map(|b| run.bytes(joined.of(b))))?;
            counts = counts.and(&of_solid);
            opaque = Some(image);
        }
        if too_long(&counts) {
            return Ok((None, None));
        }
        composite.finish([bytes(composite.state), bytes(composite.planes)], accumulator)?;
        Ok((Some(counts), opaque))
    }

    /// Hands the inputs of all stages to `run`.
    fn with_inputs<T>(
        &self,
        splats: &Splats<'_>,
        all: &[u32],
        attributes: &Attributes,
        received: &[[f32; 3]],
        accumulator: &Accumulator,
        run: impl FnOnce(&[(BufferId, &[u8])]) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let Splats { input, ids, footprints, raster, opaque, sort, .. } = *splats;
        let (origin, camera, materials) = (input.cloud.origin, input.camera, input.materials);
        let count = ids.len() as u32;
        let view = order::view_bytes(origin, count, camera, sort);
        let of_object = |id: &u32| input.cloud.object[*id as usize];
        let objects: Vec<u32> =
            if accumulator.object.is_empty() { Vec::new() } else { all.iter().map(of_object).collect() };
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
        let shares = shade::shadow_shares(input, all);
        let cast = shadows::uploads(&self.shadows, splats.castings, all, &shares)?;
        let (direction, params, order, objects) = (sort.direction, raster, &order[..], &objects[..]);
        let opaque = self.resolve.is_none().then_some(opaque);
        let into = follow::Input { camera, footprints, materials, opaque, direction, params, order, objects };
        let composited = follow::uploads(composite, &into, accumulator)?;
        let solid: Vec<u32> = (count..attributes.room().splats).collect();
        let of_solid = |(resolved, _): &(resolve::Recorded, Joined)| {
            resolved.uploads_beside_splats(camera, footprints, &solid, objects)
        };
        let resolved = self.resolve.as_ref().map(of_solid).transpose()?;
        let mut inputs: Vec<(BufferId, &[u8])> = self.sort.iter().map(|sort| (sort.view, &view[..])).collect();
        inputs.extend(in_project.inputs(attributes.inputs(&projected.attributes)));
        inputs.extend(in_project.inputs(projected.inputs(&project)));
        for ((shadow, joined), uploads) in self.shadows.iter().zip(&cast) {
            inputs.extend(joined.inputs(shadow.inputs(uploads)));
        }
        inputs.extend(in_shade.inputs(shaded.inputs(&shade)));
        for ((resolved, joined), uploads) in self.resolve.iter().zip(&resolved) {
            inputs.extend(joined.inputs(resolved.inputs(uploads)));
        }
        inputs.extend(in_composite.inputs(composite.inputs(&composited)));
        // What another stage leaves on the device is not uploaded.
        inputs.retain(|(_, bytes)| !bytes.is_empty());
        run(&inputs)
    }
}

/// Whether there was room for what was counted; if not it gets what it needs.
fn grown(counts: Result<Counts, Error>, room: &mut u32) -> Result<bool, Failure> {
    match counts {
        Err(Error::Overflow { needed, .. }) if u32::try_from(needed).is_ok_and(|n| n > *room) => {
            *room = needed as u32;
            Ok(false)
        }
        counts => Ok(counts.map(|_| true)?),
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
            depths: false,
            objects: false,
        };
        let rooms = Rooms { all: room, solid: None };
        let whole =
            Whole::record(&rooms, &attributes, &input, ChannelLayout::default(), true, &[]).expect("a recording");
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
            Whole::record(&rooms, &attributes, &input, ChannelLayout::default(), false, &[]).expect("a recording");
        given.recording.check().expect("no fault");
        assert!(given.sort.is_none() && given.composite.0.sorted.is_none());
        // Attributes of 40 bytes, a key, and what is sorted, projected, shaded, counted; entries.
        assert!(whole.recording.bytes() < 3000 * 140 + 5000 * 16 + 64 * 48 * 16 + (64 << 10));
    }
}
