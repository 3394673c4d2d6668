//! Facts of objects that all their splats have together.

use rayon::prelude::*;
use splat_core::Cloud;

/// Splats that one thread looks at before it helps another: to join what is known of a thousand objects takes less time than so many.
const CHUNK: usize = 1 << 14;

/// What is known of each of so many objects, of which `nothing` is known at first: `meet` adds the splat of this number to its object, `join` what another
/// thread knows of that object. Neither may depend on the order of splats.
pub(crate) fn by_object<T: Clone + Send + Sync>(
    cloud: &Cloud,
    objects: usize,
    nothing: &T,
    meet: impl Fn(&mut T, usize) + Sync,
    join: impl Fn(&mut T, &T) + Sync,
) -> Vec<T> {
    let none = || vec![nothing.clone(); objects];
    let with = |mut known: Vec<T>, chunk: usize| {
        let first = chunk * CHUNK;
        let objects = &cloud.object[first..cloud.len().min(first + CHUNK)];
        objects.iter().zip(first..).for_each(|(object, i)| meet(&mut known[*object as usize], i));
        known
    };
    let joined = |mut known: Vec<T>, others: Vec<T>| {
        known.iter_mut().zip(&others).for_each(|(known, other)| join(known, other));
        known
    };
    (0..cloud.len().div_ceil(CHUNK)).into_par_iter().fold(none, with).reduce(none, joined)
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
