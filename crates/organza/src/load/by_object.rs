//! Reduces the splats of each object to one value per object, in parallel.

use rayon::prelude::*;
use splat_core::Cloud;

/// Splats per task. Joining the values of a thousand objects takes less time than this many splats.
const CHUNK: usize = 1 << 14;

/// Returns one value per object, which starts as `nothing`. `meet` adds the splat with the given index to the value of its object. `join` merges the values
/// of one object from two threads. The results of both must not depend on the order of the splats, because that of the tasks varies.
pub(crate) fn by_object<T: Clone + Send + Sync>(
    cloud: &Cloud,
    objects: usize,
    nothing: &T,
    meet: impl Fn(&mut T, usize) + Sync,
    join: impl Fn(&mut T, &T) + Sync,
) -> Vec<T> {
    let start = || vec![nothing.clone(); objects];
    let meet_chunk = |mut known: Vec<T>, chunk: usize| {
        let first = chunk * CHUNK;
        let objects = &cloud.object[first..cloud.len().min(first + CHUNK)];
        objects.iter().zip(first..).for_each(|(object, i)| meet(&mut known[*object as usize], i));
        known
    };
    let join_values = |mut known: Vec<T>, others: Vec<T>| {
        known.iter_mut().zip(&others).for_each(|(known, other)| join(known, other));
        known
    };
    (0..cloud.len().div_ceil(CHUNK)).into_par_iter().fold(start, meet_chunk).reduce(start, join_values)
}

#[cfg(test)]
mod tests {
    use super::by_object;
    use splat_core::{Cloud, Splat};

    #[test]
    fn each_splat_is_met_once_by_its_object() {
        let mut cloud = Cloud::default();
        let splats = 3 * super::CHUNK + 5;
        (0..splats).for_each(|i| cloud.push(&Splat { object: (i % 3) as u32, ..Splat::default() }));
        let sums = by_object(&cloud, 4, &0u64, |sum, i| *sum += i as u64, |sum, other| *sum += other);
        let expected = |object| (object..splats).step_by(3).map(|i| i as u64).sum::<u64>();
        assert_eq!(sums, [expected(0), expected(1), expected(2), 0]);
        assert_eq!(by_object(&Cloud::default(), 2, &7, |_, _| (), |_, _| ()), [7, 7]);
    }
}
