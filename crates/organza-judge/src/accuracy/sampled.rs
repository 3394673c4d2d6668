//! Bias and variance of a random setting, estimated from the pictures of several seeds.
//!
//! Each of n pictures x_i has expectation μ and variance σ² in a pixel; r is a reference. The mean over i of RMSE(x_i, r) is
//! the error of one picture; its 95 % interval follows from the spread (Student's t). The mean of (x_i − r)(x_j − r), i ≠ j,
//! estimates (μ − r)², the squared bias, which no number of repeats removes. The mean of (x_i − r)² less that estimate is σ²,
//! for any r. Every mean is taken over pixels and channels.

use super::Distance;
use organza::Error;
use reference::metrics::{Errors, Image, Linear, compare};
use reference::statistics::{Mean, mean_with_interval, student_t_95};

/// Several seeds of one setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// Number of pictures, each with another seed.
    pub seeds: usize,
    /// RMSE of one picture against the limit, and its interval: that of the mean over seeds, widened by the limit's
    /// error.
    pub from_limit: Mean,
    /// RMSE of one picture against physical truth, if the scene has a truth.
    pub from_truth: Option<Mean>,
    /// Standard deviation of one picture, root of the mean variance over pixels and channels.
    pub noise: f64,
    /// RMS distance of the expectation from the limit; `None` if it does not differ from 0 at 95 %.
    pub bias: Option<f64>,
}

impl Sampled {
    /// Judges pictures of one setting; `None` for fewer than two.
    ///
    /// # Errors
    /// [`Error::Internal`] for unequal sizes.
    pub fn new(
        images: &[Image<Linear>],
        limit: &Image<Linear>,
        own_error: f64,
        truth: Option<&Image<Linear>>,
    ) -> Result<Option<Self>, Error> {
        let from = |reference: &Image<Linear>| -> Result<Option<Mean>, Error> {
            let errors: Result<Vec<f64>, _> = images.iter().map(|i| compare(i, reference).map(|e| e.rmse)).collect();
            Ok(mean_with_interval(&errors.map_err(|e| Error::Internal(e.to_string()))?))
        };
        let Some(mut from_limit) = from(limit)? else { return Ok(None) };
        from_limit.half_width += own_error;
        let products = products(images, limit);
        let seeds: Vec<usize> = (0..images.len()).collect();
        let square = bias_square(&products, &seeds);
        let mean_square = seeds.iter().map(|&i| products[i][i]).sum::<f64>() / seeds.len() as f64;
        Ok(Some(Self {
            seeds: images.len(),
            from_limit,
            from_truth: truth.map(from).transpose()?.flatten(),
            noise: (mean_square - square).max(0.0).sqrt(),
            bias: (square > uncertainty(&products, &seeds)).then(|| square.sqrt()),
        }))
    }
}

/// Means over pixels and channels of (x_i − r)·(x_j − r).
fn products(images: &[Image<Linear>], reference: &Image<Linear>) -> Vec<Vec<f64>> {
    let numbers = (3 * reference.pixels().len()).max(1) as f64;
    let apart = |i: usize, k: usize, c: usize| images[i].pixels()[k][c] - reference.pixels()[k][c];
    let product = |i: usize, j: usize| {
        let pixel = |k: usize| (0..3).map(|c| apart(i, k, c) * apart(j, k, c)).sum::<f64>();
        (0..reference.pixels().len()).map(pixel).sum::<f64>() / numbers
    };
    (0..images.len()).map(|i| (0..images.len()).map(|j| product(i, j)).collect()).collect()
}

/// Mean of the products of different seeds: without bias for (μ − r)², for their noise is independent.
fn bias_square(products: &[Vec<f64>], seeds: &[usize]) -> f64 {
    let pairs = (seeds.len() * (seeds.len() - 1)) as f64;
    seeds.iter().flat_map(|&i| seeds.iter().filter(move |j| **j != i).map(move |&j| products[i][j])).sum::<f64>()
        / pairs
}

/// Half of the 95 % interval of [`bias_square`]: leaving out one seed after the other (jackknife), Student's t.
fn uncertainty(products: &[Vec<f64>], seeds: &[usize]) -> f64 {
    if seeds.len() < 3 {
        return f64::INFINITY;
    }
    let without = |i: usize| seeds.iter().copied().filter(|j| *j != i).collect::<Vec<usize>>();
    let left: Vec<f64> = seeds.iter().map(|&i| bias_square(products, &without(i))).collect();
    let n = left.len() as f64;
    let mean = left.iter().sum::<f64>() / n;
    let square = left.iter().map(|l| (l - mean).powi(2)).sum::<f64>() * (n - 1.0) / n;
    student_t_95(seeds.len() - 1) * square.sqrt()
}

impl Distance {
    /// Mean of each measure over pictures, the largest of the largest errors; `None` for none.
    pub(super) fn mean(distances: &[Self]) -> Option<Self> {
        let n = distances.len() as f64;
        let mean = |f: &dyn Fn(&Self) -> f64| distances.iter().map(f).sum::<f64>() / n;
        let errors = |select: fn(&Self) -> &Errors| Errors {
            rmse: mean(&|d| select(d).rmse),
            bias: mean(&|d| select(d).bias),
            mean_absolute: mean(&|d| select(d).mean_absolute),
            max: distances.iter().map(|d| select(d).max).fold(0.0, f64::max),
        };
        (!distances.is_empty()).then(|| Self {
            linear: errors(|d| &d.linear),
            display: errors(|d| &d.display),
            psnr: mean(&|d| d.psnr),
            flip: mean(&|d| d.flip),
            epsilon: mean(&|d| d.epsilon),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    const SIZE: [usize; 2] = [64, 48];

    /// Uniform noise of deviation `noise` around ½ + `bias`.
    fn picture(seed: u64, noise: f64, bias: f64) -> Image<Linear> {
        let value = |k: usize, c: u64| 0.5 + bias + noise * 12f64.sqrt() * (rng::unit(seed, 3, k as u64, c) - 0.5);
        let pixels = (0..SIZE[0] * SIZE[1]).map(|k| [value(k, 0), value(k, 1), value(k, 2)]).collect();
        Image::from_radiance(SIZE, pixels).unwrap()
    }

    #[test]
    fn noise_and_bias_are_told_apart() {
        let limit = Image::from_radiance(SIZE, vec![[0.5; 3]; SIZE[0] * SIZE[1]]).unwrap();
        let images: Vec<_> = (0..5).map(|s| picture(s, 0.1, 0.02)).collect();
        let found = Sampled::new(&images, &limit, 0.001, None).unwrap().unwrap();
        // 9216 numbers of deviation 0.1 in five pictures: one standard error of the noise is 0.4 %, of the bias 4 %.
        assert!((found.noise / 0.1 - 1.0).abs() < 0.016, "{found:?}");
        assert!((found.bias.unwrap() / 0.02 - 1.0).abs() < 0.17, "{found:?}");
        let expected = 0.1f64.hypot(0.02);
        assert!((found.from_limit.mean - expected).abs() < found.from_limit.half_width, "{found:?}");
        assert!(found.from_limit.half_width > 0.001 && found.from_limit.half_width < 0.003, "{found:?}");
        assert_eq!(Sampled::new(&images[..1], &limit, 0.0, None).unwrap(), None);
    }

    #[test]
    fn what_has_no_bias_hardly_ever_shows_one() {
        let limit = Image::from_radiance(SIZE, vec![[0.5; 3]; SIZE[0] * SIZE[1]]).unwrap();
        let bias = |run: u64| {
            let images: Vec<_> = (0..5).map(|s| picture(10 * run + s, 0.1, 0.0)).collect();
            Sampled::new(&images, &limit, 0.0, None).unwrap().unwrap().bias
        };
        let found: Vec<_> = (0..40).map(bias).collect();
        let none = found.iter().filter(|b| b.is_none()).count();
        // On one side 2.5 % would show one: six or more of 40 in one case of a thousand.
        assert!(none >= 35, "{none} of 40");
        // A standard error of the square is 2.9e-5.
        assert!(found.iter().flatten().all(|b| *b < 0.012), "{found:?}");
    }
}
