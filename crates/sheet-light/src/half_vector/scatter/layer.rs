//! A homogeneous layer of a scattering medium between two streams, in closed form, however thick it is.
//!
//! With F the flux with the light and B the one against it, per area, and E that of the beam,
//!
//! dF/dτ = −γ₁F + γ₂B + γ₄ωE, dB/dτ = γ₁B − γ₂F − γ₃ωE, dE/dτ = −E,
//!
//! γ₁ and γ₂ those of Eddington (W. Meador, W. Weaver 1980), but γ₂ ≥ 0: no reflectance is negative; γ₁ − γ₂ = 2(1 − ω), so
//! ω = 1 absorbs nothing. Reflectance R and transmittance T for diffuse light follow, and the adding of layers
//! T₁T₂/(1 − R₁R₂) with them. Here the same is written for ψ = F + B and J = F − B at the faces,
//!
//! J = aψ − bψ′ − s↑, J′ = bψ − aψ′ + s↓,
//!
//! a = Y·coth kτ, b = Y/sinh kτ, Y = k/(γ₁ + γ₂), k² = γ₁² − γ₂²: (1 − R∓T)/(1 + R±T) = a ∓ b. Then layers add as conductors in a
//! row do, nothing cancels as R → 1, and what flows sideways can be added at the faces.

use libm::{exp, expm1, sinh, tanh};

/// Optical thickness below which light is scattered once in a layer at most.
const THIN: f64 = 1e-3;

/// Least optical thickness for diffuse light: what is empty resists this little.
const EMPTY: f64 = 1e-6;

/// Distance of k² from 1 below which light of the beam and diffuse light fade alike, and the closed form divides by 0.
const ALIKE: f64 = 1e-4;

/// kτ from which nothing comes through.
const DEEP: f64 = 80.0;

/// Greatest |g| of what is not in the peak: no share of the beam's light is negative.
const WIDEST: f64 = 2.0 / 3.0;

/// What a layer is made of, the peak of the phase function counted as light that was not scattered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Optics {
    /// Optical thickness.
    pub(crate) tau: f64,
    /// Single-scattering albedo.
    pub(crate) omega: f64,
    /// Mean cosine.
    pub(crate) asymmetry: f64,
}

/// What a layer does with diffuse light, and what it makes of a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Layer {
    /// a.
    pub(crate) conductance: f64,
    /// b.
    pub(crate) through: f64,
    /// s↑ and s↓ for a beam of 1 at the face that light comes in by.
    pub(crate) sources: [f64; 2],
}

impl Layer {
    pub(crate) fn new(optics: &Optics) -> Self {
        let Optics { tau, omega, .. } = *optics;
        let g = optics.asymmetry.clamp(-WIDEST, WIDEST);
        let behind = 0.25 * (2.0 - 3.0 * g);
        if tau < THIN {
            let (conductance, through) = conductances(tau.max(EMPTY), if tau < EMPTY { 1.0 } else { omega }, g);
            // What comes out of a face where none comes in from elsewhere, as ψ and J have it: even and odd part.
            let scattered = -omega * expm1(-tau);
            let even = 0.5 * scattered * (1.0 + conductance - through);
            let odd = 0.5 * (2.0 * behind - 1.0) * scattered * (1.0 + conductance + through);
            return Self { conductance, through, sources: [even + odd, even - odd] };
        }
        let gamma2 = back(omega, g);
        let gamma1 = 2.0 * (1.0 - omega) + gamma2;
        let from_alike = gamma1 * gamma1 - gamma2 * gamma2 - 1.0;
        if from_alike.abs() < ALIKE {
            // A little more absorption: k² falls with ω about as −4.
            return Self::new(&Optics { omega: omega - ALIKE, ..*optics });
        }
        let (conductance, through) = conductances(tau, omega, g);
        // The solution that fades as the beam does: F = A·e^(−τ), B = Z·e^(−τ).
        let ahead = 1.0 - behind;
        let a = omega * (ahead * (gamma1 + 1.0) + gamma2 * behind) / from_alike;
        let z = omega * (behind * (gamma1 - 1.0) + gamma2 * ahead) / from_alike;
        let sum = a + z;
        let net = a - z;
        let left = exp(-tau);
        let sources =
            [conductance * sum - through * sum * left - net, net * left - through * sum + conductance * sum * left];
        Self { conductance, through, sources }
    }
}

/// γ₂.
fn back(omega: f64, g: f64) -> f64 {
    (0.25 * (omega * (4.0 - 3.0 * g) - 1.0)).max(0.0)
}

/// a and b.
fn conductances(tau: f64, omega: f64, g: f64) -> (f64, f64) {
    let sum = 2.0 * (1.0 - omega) + 2.0 * back(omega, g);
    let k = libm::sqrt(2.0 * (1.0 - omega) * sum);
    let x = k * tau;
    if x < 1e-4 {
        // x·coth x and x/sinh x.
        return ((1.0 + x * x / 3.0) / (sum * tau), (1.0 - x * x / 6.0) / (sum * tau));
    }
    let admittance = k / sum;
    (admittance / tanh(x), if x > DEEP { 0.0 } else { admittance / sinh(x) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reflectance and transmittance of layers one behind the other for diffuse light that comes in on one side, and of their
    /// sources, by elimination from the far side.
    fn stack(layers: &[Layer]) -> [f64; 2] {
        // At the far face nothing comes in: J = ψ.
        let mut pivots = vec![1.0 + layers[layers.len() - 1].conductance];
        for n in (0..layers.len()).rev() {
            let before = if n == 0 { 1.0 } else { layers[n - 1].conductance };
            pivots.push(
                before + layers[n].conductance - layers[n].through * layers[n].through / pivots[pivots.len() - 1],
            );
        }
        // Incoming light of 1 is a source of 2: J = 2 − ψ.
        let mut psi = 2.0 / pivots[layers.len()];
        let reflected = psi - 1.0;
        for n in 0..layers.len() {
            psi *= layers[n].through / pivots[layers.len() - 1 - n];
        }
        [reflected, psi]
    }

    #[test]
    fn ms03_a_thousand_layers_of_optical_depth_1000_are_the_closed_form() {
        for g in [0.0, 0.3, 0.5] {
            let one = Layer::new(&Optics { tau: 1.0, omega: 1.0, asymmetry: g });
            let [reflected, through] = stack(&[one; 1000]);
            // γ of two streams in Eddington's approximation where nothing is absorbed: 3/4·(1 − g).
            let expected = 1.0 / (1.0 + 0.75 * (1.0 - g) * 1000.0);
            assert!((through / expected - 1.0).abs() < 1e-10, "g {g}: {through:e}, not {expected:e}");
            assert!((reflected + through - 1.0).abs() < 1e-10, "g {g}: {reflected} and {through}");
        }
    }

    /// Reflected and transmitted light of a beam of 1 on layers, scattered or not, and what two streams absorb.
    fn lit(optics: &[Optics]) -> [f64; 3] {
        let layers: Vec<Layer> = optics.iter().map(Layer::new).collect();
        let n = layers.len();
        let mut beam = 1.0;
        let mut given = vec![0.0; n + 1];
        let mut absorbed = 0.0;
        for (k, layer) in layers.iter().enumerate() {
            given[k] += beam * layer.sources[0];
            given[k + 1] += beam * layer.sources[1];
            absorbed -= beam * (layer.sources[0] + layer.sources[1] + expm1(-optics[k].tau));
            beam *= exp(-optics[k].tau);
        }
        let conductance_of = |k: Option<usize>| k.and_then(|k| layers.get(k)).map_or(1.0, |layer| layer.conductance);
        let mut sums: Vec<f64> = (0..=n).map(|k| conductance_of(k.checked_sub(1)) + conductance_of(Some(k))).collect();
        for k in (0..n).rev() {
            let share = layers[k].through / sums[k + 1];
            sums[k] -= share * layers[k].through;
            given[k] += share * given[k + 1];
        }
        let mut psi = vec![given[0] / sums[0]];
        for k in 0..n {
            psi.push((given[k + 1] + layers[k].through * psi[k]) / sums[k + 1]);
        }
        for (k, layer) in layers.iter().enumerate() {
            absorbed += (layer.conductance - layer.through) * (psi[k] + psi[k + 1]);
        }
        [psi[0], psi[n] + beam, absorbed]
    }

    #[test]
    fn ms02_energy_is_all_there_in_5_to_320_layers_and_what_comes_through_converges() {
        for omega in [0.7, 1.0] {
            // Means of a medium that changes on its way, τ 10 in all.
            let medium = |n: u32| -> Vec<Optics> {
                let depth = |z: f64| 10.0 * (z - 0.08 * libm::sin(8.0 * z) / 0.8) / (1.0 - 0.1 * libm::sin(8.0));
                let layer = |k: u32| {
                    let [near, far] = [k, k + 1].map(|k| f64::from(k) / f64::from(n));
                    let omega = if omega == 1.0 { 1.0 } else { omega + 0.2 * libm::cos(5.0 * (near + far)) };
                    Optics {
                        tau: depth(far) - depth(near),
                        omega,
                        asymmetry: 0.2 + 0.2 * libm::sin(3.0 * (near + far)),
                    }
                };
                (0..n).map(layer).collect()
            };
            let truth = lit(&medium(5120));
            let found = [5, 10, 20, 40, 80, 160, 320].map(|n| lit(&medium(n)));
            for powers in found {
                assert!((powers.iter().sum::<f64>() - 1.0).abs() < 1e-9, "ω {omega}: {powers:?}");
                assert!(omega < 1.0 || powers[2].abs() < 1e-9, "{powers:?}");
            }
            let error = |n: usize| (found[n][1] - truth[1]).abs() + (found[n][0] - truth[0]).abs();
            let order = libm::log2(error(1) / error(5)) / 4.0;
            assert!(order > 0.9, "ω {omega}: order {order}, {found:?}, {truth:?}");
        }
    }

    #[test]
    fn layers_add_to_the_layer_of_their_thickness() {
        for omega in [0.0, 0.1, 0.5, 0.9, 0.999, 1.0] {
            for g in [-0.5, 0.0, 0.46] {
                let layer = |tau: f64| Layer::new(&Optics { tau, omega, asymmetry: g });
                let [whole, parts] = [stack(&[layer(3.0)]), stack(&[layer(0.3); 10])];
                for n in 0..2 {
                    assert!((whole[n] - parts[n]).abs() < 1e-12, "ω {omega}, g {g}: {whole:?} {parts:?}");
                }
                assert!(whole[0] >= 0.0 && whole[0] + whole[1] <= 1.0 + 1e-12, "ω {omega}, g {g}: {whole:?}");
            }
        }
    }

    #[test]
    fn ms03_what_comes_through_a_layer_fades_with_its_depth_until_it_is_next_to_nothing() {
        for (omega, g) in [(0.0, 0.0), (0.5, 0.3), (0.9, -0.2), (0.999, 0.5)] {
            let conductance = Layer::new(&Optics { tau: 1e4, omega, asymmetry: g }).conductance;
            let sum = 2.0 * (1.0 - omega) + 2.0 * back(omega, g);
            let k = libm::sqrt(2.0 * (1.0 - omega) * sum);
            for depth in [12.0, 20.0, 40.0, 79.9] {
                let found = Layer::new(&Optics { tau: depth / k, omega, asymmetry: g });
                // Y/sinh kτ where the other power of e is no more.
                let expected = 2.0 * k / sum * exp(-depth);
                assert!((found.through / expected - 1.0).abs() < 1e-9, "kτ {depth}: {found:?}, not {expected:e}");
                assert!(
                    (found.conductance / conductance - 1.0).abs() < 1e-9,
                    "kτ {depth}: {found:?}, not {conductance}"
                );
            }
            assert_eq!(Layer::new(&Optics { tau: 80.1 / k, omega, asymmetry: g }).through, 0.0);
        }
    }

    #[test]
    fn what_is_scattered_out_of_a_beam_is_all_there_without_absorption() {
        for tau in [1e-7, 1e-4, 1e-3, 0.1, 1.0, 30.0, 1e4] {
            let layer = Layer::new(&Optics { tau, omega: 1.0, asymmetry: 0.4 });
            let [up, down] = layer.sources;
            assert!((up + down + expm1(-tau)).abs() < 1e-9, "τ {tau}: {up} + {down}");
            assert!(layer.conductance - layer.through <= 1e-9 * layer.conductance, "τ {tau}: {layer:?}");
        }
    }

    #[test]
    fn nothing_jumps_where_closed_forms_change() {
        let layer = |tau: f64, omega: f64| Layer::new(&Optics { tau, omega, asymmetry: 0.3 });
        let apart =
            |one: Layer, other: Layer| (0..2).map(|n| (one.sources[n] - other.sources[n]).abs()).fold(0.0, f64::max);
        assert!(apart(layer(THIN - 1e-9, 0.9), layer(THIN + 1e-9, 0.9)) < THIN);
        let most = (0..100_000).map(|n| {
            let omega = f64::from(n) * 1e-5;
            apart(layer(1.0, omega), layer(1.0, omega + 1e-5))
        });
        assert!(most.fold(0.0, f64::max) < 2e-4);
    }
}
