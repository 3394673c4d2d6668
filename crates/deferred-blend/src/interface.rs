//! Light at an interface: a part is mirrored, the rest is refracted (section 5.2.3).

use splat_core::glam::Vec3;

/// One meeting of a ray and an interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crossing {
    /// Fresnel's share of unpolarised light that is mirrored, in \[0, 1\]; 1 where reflection is total.
    pub(crate) reflectance: f32,
    /// Where the ray goes that is mirrored, unit length.
    pub(crate) mirrored: Vec3,
    /// Where the ray goes that passes; where reflection is total, the mirrored one.
    pub(crate) bent: Vec3,
}

/// A ray of direction `along` meets an interface with this normal, both of unit length; which way the normal points changes nothing.
/// `ratio` is η of Eq. 16: the sine of the angle beyond over that before.
///
/// A ratio of 1 is no interface: nothing is mirrored, and the direction keeps its bits.
pub(crate) fn cross(along: Vec3, normal: Vec3, ratio: f32) -> Crossing {
    let against = -along.dot(normal);
    let (normal, cosine) = if against < 0.0 { (-normal, (-against).min(1.0)) } else { (normal, against.min(1.0)) };
    let mirrored = (along + 2.0 * cosine * normal).normalize();
    if ratio == 1.0 {
        return Crossing { reflectance: 0.0, mirrored, bent: along };
    }
    // (1 − c)·(1 + c), not 1 − c²: near the critical angle digits matter.
    let sine_sq = ratio * ratio * (1.0 - cosine) * (1.0 + cosine);
    if sine_sq >= 1.0 {
        return Crossing { reflectance: 1.0, mirrored, bent: mirrored };
    }
    let beyond = (1.0 - sine_sq).sqrt();
    let across = (ratio * cosine - beyond) / (ratio * cosine + beyond);
    let within = (cosine - ratio * beyond) / (cosine + ratio * beyond);
    let reflectance = 0.5 * (across * across + within * within);
    // The part along the surface grows by the ratio; what is left of it at right angles to the surface is nothing, whatever the ratio.
    let bent = (ratio * (along + cosine * normal) - beyond * normal).normalize();
    Crossing { reflectance: reflectance.clamp(0.0, 1.0), mirrored, bent }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit vector that meets a plane across z at this sine.
    fn ray(sine: f32) -> Vec3 {
        Vec3::new(sine, 0.0, -(1.0 - f64::from(sine).powi(2)).sqrt() as f32)
    }

    #[test]
    fn sines_are_those_of_snell_and_shares_those_of_fresnel() {
        for ratio in [0.4f32, 1.0 / 1.5, 0.9999, 1.0001, 1.2] {
            for k in 0..=80 {
                let sine = k as f32 / 81.0;
                let s = f64::from(ratio) * f64::from(sine);
                if s >= 1.0 {
                    continue;
                }
                let found = cross(ray(sine), Vec3::Z, ratio);
                assert!((f64::from(found.bent.x) - s).abs() < 3e-7, "{ratio}, {sine}: {}", found.bent);
                assert!((found.mirrored - Vec3::new(sine, 0.0, -ray(sine).z)).length() < 3e-7);
                let c = (1.0 - f64::from(sine).powi(2)).sqrt();
                let t = (1.0 - s * s).sqrt();
                let eta = f64::from(ratio);
                let share = 0.5 * (((eta * c - t) / (eta * c + t)).powi(2) + ((c - eta * t) / (c + eta * t)).powi(2));
                assert!((f64::from(found.reflectance) - share).abs() < 2e-5, "{ratio}, {sine}");
                assert_eq!(found, cross(ray(sine), Vec3::NEG_Z, ratio), "the normal's sign");
            }
        }
        assert!((cross(ray(0.0), Vec3::Z, 1.0 / 1.5).reflectance - 0.04).abs() < 1e-7);
    }

    #[test]
    fn no_interface_changes_no_bit() {
        for k in 0..100 {
            let along = ray(k as f32 / 100.0);
            let found = cross(along, Vec3::new(0.6, 0.0, 0.8), 1.0);
            assert_eq!((found.reflectance, found.bent), (0.0, along));
        }
    }

    #[test]
    fn db8_shares_are_continuous_at_the_critical_angle_and_no_number_is_lost() {
        for ratio in [1e-15, 1.05f32, 1.5, 7.6, 1e6, 1e15] {
            for k in 0..=1000 {
                let found = cross(ray(k as f32 / 1000.0), Vec3::Z, ratio);
                assert!((0.0..=1.0).contains(&found.reflectance), "{ratio}, {k}: {}", found.reflectance);
                assert!((found.bent.length() - 1.0).abs() < 1e-6, "{ratio}, {k}: {}", found.bent);
            }
        }
        // 1 − R falls as the root of the distance δ from the critical angle, as √8·(1/ηc + η/c)·√δ = 8.22·√δ, c the cosine there.
        let mut least = 1.0f32;
        for k in 1..=16 {
            let sine = (1.0 - 2f32.powi(-k)) / 1.5;
            let passes = 1.0 - cross(ray(sine), Vec3::Z, 1.5).reflectance;
            assert!(passes < 8.23 * 2f32.powf(-0.5 * k as f32), "{k}: {passes}");
            assert!(passes < least);
            least = passes;
        }
        assert_eq!(cross(ray(0.6667), Vec3::Z, 1.5).reflectance, 1.0);
    }
}
