//! The recordings of the stages as one: their shared buffers, uploads and read-backs.

use super::{Splats, shadows};
use crate::Failure;
use hbsort::gpu as order;
use shadows::Shadow;
use splat_core::raster::OpaqueImage;
use splat_core::raster::gpu::{Attributes, Capacities, Counts, follow, project, record, resolve};
use splat_core::shade::{ChannelLayout, ShadeInput, gpu as shade};
use splat_core::{Accumulator, Error};
use splat_shaders::{BufferId, Joined, Overflow, Recording, Run};
use tsm::gpu::CastRoom;

/// The recordings of the stages as one.
pub(super) struct Whole {
    pub(super) recording: Recording,
    /// None where the splats are in order.
    sort: Option<order::Recorded>,
    pub(super) project: (project::Recorded, Joined),
    /// Of each light with a shadow.
    pub(super) shadows: Vec<Shadow>,
    shade: (shade::Recorded, Joined),
    /// None where there are no opaque splats, or they are resolved.
    resolve: Option<(resolve::Recorded, Joined)>,
    composite: (splat_core::raster::gpu::Recorded, Joined),
}

/// Room for all splats and for the opaque ones.
pub(super) struct Rooms {
    pub(super) composite: Capacities,
    pub(super) solid: Option<resolve::Capacities>,
}

impl Whole {
    pub(super) fn record(
        rooms: &Rooms,
        attributes: &Attributes,
        input: &ShadeInput<'_>,
        layout: ChannelLayout,
        sorts: bool,
        casts: &[CastRoom],
    ) -> Result<Self, Error> {
        let room = rooms.composite;
        // The translucent ones come first.
        let sorted = order::Capacities { splats: room.ordered, kept: room.ordered };
        let sort = sorts.then(|| order::record(sorted));
        let attributes = attributes.room();
        let footprints = room.footprints;
        let materials = room.materials;
        let projected =
            project::record(project::Capacities { attributes, footprints, materials, depth: room.needs_depth() })?;
        let shaded = shade::record(shade::Capacities::for_input(input, attributes, layout));
        let composite = if sorts { follow::record(room)? } else { record(room)? };
        let mut recording = sort.as_ref().map_or_else(Recording::default, |sort| sort.recording.clone());
        let at = &projected.attributes;
        let positions: Vec<_> =
            sort.iter().flat_map(|sort| [(at.positions, sort.positions), (at.radii, sort.radii)]).collect();
        let in_project = recording.join(&projected.recording, &positions);
        let at = at.in_joined(&in_project);
        let shadows = shadows::join(&mut recording, casts, &at);
        let received = shadows.first().map(|(shadow, joined)| (shaded.received, joined.buffer(shadow.received)));
        let known: Vec<_> = shaded.attributes.shared(&at).into_iter().chain(received).collect();
        let in_shade = recording.join(&shaded.recording, &known);
        let mut resolve = None;
        if let Some(solid) = rooms.solid {
            let resolved = resolve::record(solid)?;
            let known = [
                (resolved.splats, in_project.buffer(projected.splats)),
                (resolved.values, in_shade.buffer(shaded.values)),
            ];
            let joined = recording.join(&resolved.recording, &known);
            resolve = Some((resolved, joined));
        }
        let mut taken = vec![
            (composite.splats, in_project.buffer(projected.splats)),
            (composite.values, in_shade.buffer(shaded.values)),
        ];
        if let (Some(sort), Some(sorted)) = (&sort, composite.sorted) {
            taken.extend([(composite.order, sort.places), (sorted, sort.state)]);
        }
        taken.extend(resolve.iter().map(|(resolved, joined)| (composite.opaque, joined.buffer(resolved.image))));
        let in_composite = recording.join(&composite.recording, &taken);
        let read = [
            in_project.buffer(projected.state),
            in_composite.buffer(composite.state),
            in_composite.buffer(composite.planes),
        ];
        let of_shadows = shadows.iter().map(|(shadow, joined)| joined.buffer(shadow.cast.state));
        let of_solid = resolve.iter().flat_map(|(r, joined)| [r.state, r.image].map(|buffer| joined.buffer(buffer)));
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

impl Whole {
    /// Whether all entries had room; those that had not get what they need.
    pub(super) fn had_room(&self, run: &Run, rooms: &mut Rooms) -> Result<bool, Failure> {
        let (composite, joined) = &self.composite;
        let mut had = grown(composite.counts(run.bytes(joined.buffer(composite.state))), &mut rooms.composite.entries)?;
        if let (Some((resolved, joined)), Some(solid)) = (&self.resolve, &mut rooms.solid) {
            had &= grown(resolved.counts(run.bytes(joined.buffer(resolved.state))), &mut solid.entries)?;
        }
        Ok(had)
    }

    /// Takes what was read back, if nothing was `too_long` for the device, and gives counts of all splats.
    pub(super) fn finish(
        &self,
        run: &Run,
        accumulator: &mut Accumulator,
        too_long: impl Fn(&Counts) -> bool,
    ) -> Result<(Option<Counts>, Option<OpaqueImage>), Failure> {
        let (composite, joined) = &self.composite;
        let bytes = |buffer| run.bytes(joined.buffer(buffer));
        let mut counts = composite.counts(bytes(composite.state))?;
        let mut opaque = None;
        if let Some((resolved, joined)) = &self.resolve {
            let (image, of_solid) =
                resolved.finish([resolved.state, resolved.image].map(|b| run.bytes(joined.buffer(b))))?;
            counts = counts.and(&of_solid);
            opaque = Some(image);
        }
        if too_long(&counts) {
            return Ok((None, None));
        }
        composite.finish([bytes(composite.state), bytes(composite.planes)], accumulator)?;
        Ok((Some(counts), opaque))
    }

    /// Hands the inputs of all stages to `run`: of all splats, their attributes, and what they receive.
    pub(super) fn with_inputs<T>(
        &self,
        splats: &Splats<'_>,
        splat_ids: &[u32],
        attributes: &Attributes,
        received: &[[f32; 3]],
        accumulator: &Accumulator,
        run: impl FnOnce(&[(BufferId, &[u8])]) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let Splats { input, ids, footprints, raster, opaque, sort, .. } = *splats;
        let origin = input.cloud.origin;
        let camera = input.camera;
        let materials = input.materials;
        let count = ids.len() as u32;
        let view = order::view_bytes(origin, count, camera, sort);
        let of_object = |id: &u32| input.cloud.object[*id as usize];
        let objects: Vec<u32> =
            if accumulator.object.is_empty() { Vec::new() } else { splat_ids.iter().map(of_object).collect() };
        // Where nothing sorts they come in their order.
        let order: Vec<u32> = if self.sort.is_some() { Vec::new() } else { (0..count).collect() };
        let (projected, in_project) = &self.project;
        let (shaded, in_shade) = &self.shade;
        let (composite, in_composite) = &self.composite;
        let to = project::Input { origin, camera, footprints, materials, params: raster };
        let project = projected.uploads(&to, attributes)?;
        let shade = if self.shadows.is_empty() {
            shaded.uploads(input, attributes, received)?
        } else {
            shaded.uploads_beside_light(input, attributes)?
        };
        let shares = shade::shadow_shares(input, splat_ids);
        let cast = shadows::uploads(&self.shadows, splats.castings, splat_ids, &shares)?;
        let direction = sort.direction;
        let params = raster;
        let order = &order[..];
        let objects = &objects[..];
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
        Err(Error::Overflow(Overflow { needed, .. })) if u32::try_from(needed).is_ok_and(|n| n > *room) => {
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
        let size = [64, 48];
        let view = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, view, size).expect("a camera");
        let materials = [Material::default()];
        let objects = [];
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
        let rooms = Rooms { composite: room, solid: None };
        let whole =
            Whole::record(&rooms, &attributes, &input, ChannelLayout::default(), true, &[]).expect("a recording");
        whole.recording.check().expect("no fault");
        let steps = |buffer: fn(&Step) -> Option<BufferId>| -> Vec<&str> {
            let buffers = whole.recording.buffers();
            whole.recording.steps().iter().filter_map(buffer).map(|b| buffers[b.index()].name).collect()
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
