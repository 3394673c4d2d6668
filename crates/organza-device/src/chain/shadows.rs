//! Shadows made on the device: deposits, lists and look-ups of each light among the recordings of the chain.

use crate::Failure;
use splat_core::raster::gpu::{AttributeBuffers, Attributes};
use splat_shaders::{Joined, Overflow, Recording, Run};
use tsm::gpu::{CastRoom, Casting, RecordedShadow, ShadowUploads, record_shadow};

/// The recorded shadow of a light, and where it lies in the whole.
pub(super) type Shadow = (RecordedShadow, Joined);

/// Room for the shadows, before the number of their entries is known: no more than a kernel sees. `None` where that is too
/// little for those that are given.
pub(super) fn rooms(castings: &[Casting], attributes: &Attributes, binding_bytes: u64) -> Option<Vec<CastRoom>> {
    let room = |casting: &Casting| {
        let most = u32::try_from(binding_bytes / (4 * u64::from(casting.channels()))).unwrap_or(u32::MAX);
        (casting.given() <= most.into()).then(|| casting.room(attributes.room(), casting.expected().min(most)))
    };
    castings.iter().map(room).collect()
}

/// The shadows of all lights behind a recording that holds the attributes; what they let through lies in one buffer.
pub(super) fn join(recording: &mut Recording, rooms: &[CastRoom], attributes: &AttributeBuffers) -> Vec<Shadow> {
    let mut shadows: Vec<Shadow> = Vec::new();
    for (light, room) in (0u32..).zip(rooms) {
        let shadow = record_shadow(*room, light);
        let received = shadows.first().map(|(first, joined)| (shadow.received, joined.buffer(first.received)));
        let known: Vec<_> = shadow.attributes().shared(attributes).into_iter().chain(received).collect();
        let joined = recording.join(&shadow.recording, &known);
        shadows.push((shadow, joined));
    }
    shadows
}

/// The bytes of the shadows of some splats, which take these shares of them.
pub(super) fn uploads(
    shadows: &[Shadow],
    castings: &[Casting],
    ids: &[u32],
    shares: &[f32],
) -> Result<Vec<ShadowUploads>, Failure> {
    let pairs = shadows.iter().zip(castings);
    pairs.map(|((shadow, _), casting)| Ok(shadow.uploads(casting, Some(ids), shares)?)).collect()
}

/// Whether all entries of a run had room; those that had not get what they need.
pub(super) fn had_room(shadows: &[Shadow], run: &Run, rooms: &mut [CastRoom]) -> Result<bool, Failure> {
    let mut had = true;
    for ((shadow, joined), room) in shadows.iter().zip(rooms) {
        match shadow.cast.found(run.bytes(joined.buffer(shadow.cast.state))) {
            Err(tsm::Error::Overflow(Overflow { needed, .. }))
                if u32::try_from(needed).is_ok_and(|n| n > room.entries) =>
            {
                (room.entries, had) = (needed as u32, false);
            }
            found => drop(found?),
        }
    }
    Ok(had)
}
