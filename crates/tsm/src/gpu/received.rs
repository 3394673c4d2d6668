//! Light that splats receive, from their attributes: receivers in the light's frame, look-ups, and each splat's share of the
//! shadow, in the form that shading reads ([`splat_core::shade::gpu`]).
//!
//! The map is the processor's and uploaded, or [`super::record_shadow`] leaves it on the device. The splats may be those that
//! kernels have made: whoever knows them joins the buffers.

use super::look_up::{MapUploads, RecordedLookUp, Room, record_look_up};
use crate::{Error, ShadowMap};
use splat_core::glam::DVec3;
use splat_core::raster::gpu::{AttributeBuffers, AttributeRoom};
use splat_shaders::layouts::{CastView, ShadowView};
use splat_shaders::{BufferId, Groups, Overflow, Recording, kernels};

/// Threads of a workgroup.
const GROUP: u32 = 256;

/// Recorded look-ups of splats, and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedReceived {
    /// The commands of the device.
    pub recording: Recording,
    /// Input: the splats. Their cross-sections and materials are not read.
    pub attributes: AttributeBuffers,
    /// Input: how much of a shadow each splat takes, in \[0, 1\], f32.
    pub shares: BufferId,
    /// Read back: what all splats receive, three f32 each, behind those of the lights before.
    pub received: BufferId,
    /// Input: the light's frame, as deposits have it.
    pub(super) frame: BufferId,
    /// Input: the map as look-ups see it.
    pub(super) view: BufferId,
    pub(super) map: [BufferId; 5],
    look_up: RecordedLookUp,
    splats: u32,
    frame_words: u32,
}

/// The bytes of a map that splats are looked up in.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceivedUploads {
    frame: CastView,
    view: ShadowView,
    map: MapUploads,
    shares: Vec<u8>,
}

/// Records the light that splats receive from the `light`th light with a shadow. `room` is the capacity of its map, and the
/// receivers are the splats.
pub fn record_received(room: Room, attributes: AttributeRoom, light: u32) -> RecordedReceived {
    let AttributeRoom { splats, frame_words } = attributes;
    let mut recording = Recording::default();
    let r = &mut recording;
    let frame = r.input("frame", size_of::<CastView>() as u64);
    let attributes = AttributeBuffers::record(r, attributes);
    let [positions, radii, looks, frames] = attributes.buffers();
    let each = Groups::cover(splats.div_ceil(GROUP));
    let receivers = r.scratch("receivers", 32 * u64::from(splats));
    r.dispatch(&kernels::TSM_RECEIVE, each, &[frame, positions, radii, looks, frames, receivers], &[]);
    let look_up = record_look_up(Room { receivers: splats, ..room });
    let in_look_up = r.join(&look_up.recording, &[(look_up.receivers, receivers)]);
    let mut last = Recording::default();
    let [own_frame, own_lights] = [last.scratch("", 0), last.scratch("", 0)];
    let shares = last.input("shadow shares", 4 * u64::from(splats));
    let received = last.scratch("received", 12 * u64::from(splats) * (1 + u64::from(light)));
    last.dispatch(&kernels::TSM_HAND_ON, each, &[own_frame, own_lights, shares, received], &[light]);
    last.read(received);
    let in_last = r.join(&last, &[(own_frame, frame), (own_lights, in_look_up.buffer(look_up.lights))]);
    let received = in_last.buffer(received);
    let shares = in_last.buffer(shares);
    r.read_only(&[received]);
    let view = in_look_up.buffer(look_up.view);
    let map = look_up.map.map(|buffer| in_look_up.buffer(buffer));
    RecordedReceived { recording, attributes, shares, received, frame, view, map, look_up, splats, frame_words }
}

impl RecordedReceived {
    /// The bytes of a map; positions of splats are relative to `origin`, those of the map's casters to `of_map`, both in the
    /// world. `shares` has the share of a shadow that each splat takes, or a single number for all splats. It is empty if an
    /// earlier recording leaves the shares on the device.
    ///
    /// # Errors
    /// [`Error::Overflow`] for a map that is larger or otherwise than the room, and for a wrong number of shares.
    pub fn uploads(
        &self,
        map: &ShadowMap,
        origin: DVec3,
        of_map: DVec3,
        shares: &[f32],
    ) -> Result<ReceivedUploads, Error> {
        let found = shares.len() as u64;
        if found > 1 && found != u64::from(self.splats) {
            return Err(Error::Overflow(Overflow {
                what: "shares of shadows",
                needed: found,
                had: self.splats.into(),
            }));
        }
        let uploads = self.look_up.map(map)?;
        let view = ShadowView { receivers: self.splats, ..uploads.view };
        let shares_of = if shares.is_empty() { self.splats } else { shares.len() as u32 };
        let frame = CastView { shares: shares_of, ..self.frame_of(map, of_map - origin) };
        Ok(ReceivedUploads { frame, view, map: uploads, shares: bytemuck::cast_slice(shares).to_vec() })
    }

    /// What receivers read of the light's frame, `moved` from its cloud's origin.
    fn frame_of(&self, map: &ShadowMap, moved: DVec3) -> CastView {
        let (light, rotation, unit) = map.frame.parts();
        let [axis_x, axis_y, axis_z] =
            [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|a| a.extend(0.0).to_array());
        let light = light + moved;
        let high = light.as_vec3();
        let low = (light - high.as_dvec3()).as_vec3();
        CastView {
            axis_x,
            axis_y,
            axis_z,
            light_high: high.extend(0.0).to_array(),
            light_low: low.extend(0.0).to_array(),
            unit: unit as f32,
            bias: map.bias,
            splats: self.splats,
            frame_words: self.frame_words,
            channels: self.look_up.room.channels,
            ..CastView::default()
        }
    }

    /// The uploads with the buffers that they go to.
    pub fn inputs<'a>(&self, uploads: &'a ReceivedUploads) -> Vec<(BufferId, &'a [u8])> {
        let views = [(self.frame, bytemuck::bytes_of(&uploads.frame)), (self.view, bytemuck::bytes_of(&uploads.view))];
        let map = self.map.into_iter().zip(uploads.map.bytes.iter().map(Vec::as_slice));
        let shares = std::iter::once((self.shares, &uploads.shares[..]));
        views.into_iter().chain(map).chain(shares).filter(|(_, bytes)| !bytes.is_empty()).collect()
    }
}
