//! Light on the visible particles: the processor's shadow maps, uploaded once and looked up on the device.

use crate::Failure;
use pbsr::gpu::{Capacities, Lighting, ShadowOf, is_shown, suits};
use pbsr::{Ensemble, Scene};
use splat_core::glam::DVec3;
use tsm::ShadowMap;
use tsm::gpu::{ReceivedUploads, RecordedReceived, Room, record_received};

/// A shadow map, and the world position that its casters are relative to.
pub type Shadow<'a> = (&'a ShadowMap, DVec3);

/// Why a scene's particles are the processor's; `None` when a device can fold them.
pub(super) fn why_not(scene: &Scene<'_>, ensemble: &Ensemble, shadows: &[Shadow<'_>]) -> Option<&'static str> {
    let params = ensemble.params();
    if params.depth_range.is_some() {
        return Some("particles with depth layers are the processor's");
    }
    if params.object {
        return Some("particles with object layers are the processor's");
    }
    if params.colored_extinction {
        return Some("particles that hide red, green and blue apart are the processor's");
    }
    if is_shown(scene, params) {
        return None;
    }
    if shadows.iter().any(|(map, _)| Room::for_map(map, 0).is_none()) {
        return Some("particles in shadow maps of polar angles are lit by the processor");
    }
    suits(scene).err()
}

/// The recorded look-ups of every light with a shadow map; `None` where nothing is lit.
pub(super) struct Light(Option<Vec<RecordedReceived>>);

impl Light {
    /// Of a scene that a device can fold.
    pub(super) fn record(scene: &Scene<'_>, ensemble: &Ensemble, room: &Capacities, shadows: &[Shadow<'_>]) -> Self {
        if is_shown(scene, ensemble.params()) {
            return Self(None);
        }
        let seen = room.seen();
        let rooms = shadows.iter().filter_map(|(map, _)| Room::for_map(map, seen.splats));
        Self(Some((0u32..).zip(rooms).map(|(light, room)| record_received(room, seen, light)).collect()))
    }

    /// Whether a map is larger than this.
    pub(super) fn is_larger(&self, binding_bytes: u64) -> bool {
        let recordings = self.0.iter().flatten().map(|shadow| &shadow.recording);
        recordings.flat_map(|r| r.buffers()).any(|buffer| buffer.bytes > binding_bytes)
    }

    /// Hands what `record` needs to know of light to it.
    pub(super) fn with<T>(
        &self,
        scene: &Scene<'_>,
        ensemble: &Ensemble,
        record: impl FnOnce(Option<&Lighting<'_>>) -> T,
    ) -> T {
        let Some(shadows) = &self.0 else { return record(None) };
        let shadows: Vec<ShadowOf<'_>> = shadows
            .iter()
            .map(|s| ShadowOf {
                recording: &s.recording,
                attributes: &s.attributes,
                shares: s.shares,
                received: s.received,
            })
            .collect();
        let lights = scene.lights.len() as u32;
        record(Some(&Lighting { params: *ensemble.params(), lights, shadows: &shadows }))
    }

    /// Each light's look-ups with the bytes of its map.
    pub(super) fn uploads(
        &self,
        scene: &Scene<'_>,
        shadows: &[Shadow<'_>],
    ) -> Result<Vec<(&RecordedReceived, ReceivedUploads)>, Failure> {
        let eye = scene.camera.position;
        let each = self.0.iter().flatten().zip(shadows);
        each.map(|(recorded, (map, origin))| Ok((recorded, recorded.uploads(map, eye, *origin, &[])?))).collect()
    }
}
