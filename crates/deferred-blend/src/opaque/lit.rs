//! Opaque surfaces on which light falls once a pixel (section 5.2.4).

use super::{Averaged, Opaque, OpaqueInput, average, silhouette};
use crate::shade::{ATTRIBUTES, Light, Place};
use crate::{Error, Params};
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::shade::MAX_CHANNELS;

/// Averages what light falls on, and lights it.
pub(super) fn resolve(
    input: &OpaqueInput<'_>,
    light: &Light<'_>,
    params: &Params,
    progress: Option<&Progress>,
) -> Result<Opaque, Error> {
    let OpaqueInput { discs, channels, objects, passes, .. } = *input;
    assert_eq!(channels as usize, light.layout.count(), "invariant: channels of the layout");
    let attributes: Vec<f32> = discs.ids.par_iter().flat_map_iter(|&i| light.attributes(i as usize)).collect();
    let max_bytes = input.max_bytes.saturating_sub(size_of_val(&*attributes) as u64);
    let values = &attributes;
    let averaged = Averaged { discs, values, by_rank: true, channels: ATTRIBUTES as u32, objects, passes, max_bytes };
    let mut seen = average(&averaged, params, progress)?;
    seen.counts.bytes += size_of_val(&*attributes) as u64;
    let Opaque { image, disc, .. } = &mut seen;
    if disc.is_empty() {
        return Ok(seen);
    }
    let turned = silhouette::turned(light, discs, image, disc);
    // Light takes the place of the averages.
    image.channels.resize_with(ATTRIBUTES.max(channels as usize), || vec![0.0; disc.len()]);
    let width = discs.size[0] as usize;
    let mut rows: Vec<Vec<&mut [f32]>> = disc.chunks(width).map(|_| Vec::new()).collect();
    for plane in &mut image.channels {
        rows.iter_mut().zip(plane.chunks_mut(width)).for_each(|(row, part)| row.push(part));
    }
    let depth = &image.depth;
    rows.into_par_iter().enumerate().for_each(|(y, mut planes)| {
        for x in (0..width).filter(|x| disc[y * width + x] != u32::MAX) {
            let k = y * width + x;
            let mut averages = std::array::from_fn(|c| planes[c][x]);
            if let Ok(at) = turned.binary_search_by_key(&k, |turned| turned.0) {
                averages[..6].copy_from_slice(&turned[at].1);
            }
            let place = Place { discs, ray: &discs.ray([x, y]), depth: depth[k], disc: disc[k] as usize };
            let mut out = [0.0; MAX_CHANNELS];
            light.on_averages(averages, &place, &mut out);
            planes.iter_mut().zip(out).for_each(|(plane, value)| plane[x] = value);
        }
    });
    image.channels.truncate(channels as usize);
    Ok(seen)
}
