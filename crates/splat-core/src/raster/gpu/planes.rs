//! The planes of an accumulator as a device has them: optical depths, channels, then depths and objects where they are asked
//! for.

use super::equal_lengths;
use crate::compositing::depth_profile::WORDS;
use crate::{Accumulator, DepthProfile, Error};

/// Planes of optical depth, then channels.
pub(super) fn sums(accumulator: &Accumulator) -> impl Iterator<Item = &[f32]> {
    accumulator.optical_depth.iter().chain(&accumulator.channels).map(Vec::as_slice)
}

/// Whether nothing was folded yet.
pub(super) fn is_fresh(accumulator: &Accumulator) -> bool {
    sums(accumulator).all(|plane| plane.iter().all(|v| v.to_bits() == 0))
        && accumulator.depth.iter().all(|profile| *profile == DepthProfile::default())
        && accumulator.object.iter().all(|object| *object == u32::MAX)
}

/// All planes, one after the other.
pub(super) fn words(accumulator: &Accumulator) -> Vec<u32> {
    let mut words: Vec<u32> = sums(accumulator).flatten().map(|v| v.to_bits()).collect();
    if !accumulator.depth.is_empty() {
        let profiles: Vec<[f32; WORDS]> = accumulator.depth.iter().map(DepthProfile::words).collect();
        (0..WORDS).for_each(|k| words.extend(profiles.iter().map(|profile| profile[k].to_bits())));
    }
    words.extend(&accumulator.object);
    words
}

/// Puts what was read back into an accumulator with the same planes.
pub(super) fn put(bytes: &[u8], accumulator: &mut Accumulator) -> Result<(), Error> {
    let profiles = accumulator.depth.len();
    let objects = accumulator.object.len();
    let numbers = sums(accumulator).map(<[f32]>::len).sum::<usize>() + WORDS * profiles + objects;
    equal_lengths([("planes read back", bytes.len(), 4 * numbers)])?;
    let (words, _) = bytes.as_chunks::<4>();
    let mut words = words.iter().map(|w| u32::from_ne_bytes(*w));
    for plane in accumulator.optical_depth.iter_mut().chain(&mut accumulator.channels) {
        plane.iter_mut().zip(&mut words).for_each(|(to, from)| *to = f32::from_bits(from));
    }
    let depths: Vec<f32> = (&mut words).take(WORDS * profiles).map(f32::from_bits).collect();
    for (k, profile) in accumulator.depth.iter_mut().enumerate() {
        *profile = DepthProfile::of_words(std::array::from_fn(|w| depths[w * profiles + k]));
    }
    accumulator.object.iter_mut().zip(words).for_each(|(to, from)| *to = from);
    Ok(())
}
