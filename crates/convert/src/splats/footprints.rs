//! Chooses the footprint of each disc of an object, and orients image footprints (Gunjee 2007, section 4.3: a texture for each point).
//!
//! The choice is by a column, by a hash of a point's place with a seed, or one footprint for the whole object. Discs keep their standard
//! deviation: the radius of a disc is scaled by the ratio of the cut-offs of the chosen and the object's footprint.
//!
//! An image's right side points along the disc's tangent t and its top along n × t. Discs without a tangent get one: the top is as near to
//! the world's +Y as the disc allows, of one that lies flat the right side to +X; turned about the normal by an angle that the seed tells.

use crate::{ConvertError, SplatParams};
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, FootprintStack, SplatKind, rng};

/// Splats per parallel task.
const CHUNK: usize = 1 << 14;
/// Stages of random numbers.
const CHOICE: u64 = 0xf007;
const TURN: u64 = 0xf008;
/// Sine of the angle between a disc's normal and +Y below which it lies flat.
const FLAT: f64 = 1e-3;

/// The choice of an object's footprints.
#[derive(Debug, Clone, PartialEq)]
pub struct FootprintChoice {
    /// The footprints of the scene.
    pub stack: FootprintStack,
    /// Ids that are chosen from, at least one.
    pub ids: Vec<u8>,
    /// Whether a column `footprint` of the points' file chooses, if the file has one.
    pub by_column: bool,
    /// Seed of the choice and of turns.
    pub seed: u64,
    /// Greatest angle by which an image is turned from upright, radians, 0 to π.
    pub turn: f64,
}

impl FootprintChoice {
    /// Whether all discs have the same, which is no image.
    fn is_one_formula(&self) -> bool {
        self.ids.len() == 1 && !self.has_images(false)
    }

    /// Whether all discs have the usual footprint, the first, and that is no image.
    pub fn is_usual(&self) -> bool {
        self.ids == [0] && self.is_one_formula()
    }

    /// Whether some of those that are chosen from are images.
    pub(crate) fn has_images(&self, by_column: bool) -> bool {
        if by_column {
            self.stack.has_images()
        } else {
            self.ids.iter().any(|id| self.stack.image((*id).into()).is_some())
        }
    }
}

/// Gives the discs of a cloud the footprints that the parameters choose: by numbers of a column, which are whole, or by their places in the
/// axes of their object, which do not move with it.
pub(crate) fn choose_footprints(
    cloud: &mut Cloud,
    params: &SplatParams,
    place: impl Fn(usize) -> Vec3 + Sync,
    column: Option<&(dyn Fn(usize) -> f64 + Sync)>,
) -> Result<(), ConvertError> {
    let Some(choice) = params.footprints.as_deref() else { return Ok(()) };
    let column = column.filter(|_| choice.by_column);
    if column.is_none() && choice.is_one_formula() {
        return Ok(());
    }
    let layers = choice.stack.layers();
    let key = |i: usize| {
        let [x, y, z] = place(i).to_array().map(|v| u64::from((v + 0.0).to_bits()));
        rng::bits(x | y << 32, z, 0, 0)
    };
    let ids = cloud.footprint.par_iter_mut().with_min_len(CHUNK).enumerate();
    match column {
        Some(column) => {
            let beyond =
                (0..ids.len()).into_par_iter().with_min_len(CHUNK).find_first(|i| column(*i) >= layers.len() as f64);
            if let Some(i) = beyond {
                let found = format!("{} in the column `footprint`", column(i));
                let expected = "an index of the scene's `footprints`, which are counted from 0; an object that states a `footprint` ignores the column";
                return Err(params.bad_text("footprint", found, expected));
            }
            ids.for_each(|(i, id)| *id = column(i) as u8);
        }
        None if choice.ids.len() > 1 => ids.for_each(|(i, id)| {
            *id = choice.ids[(rng::bits(choice.seed, CHOICE, key(i), 0) % choice.ids.len() as u64) as usize];
        }),
        None => {}
    }
    let wider = |id: u8| layers[usize::from(id)].cutoff / params.profile.cutoff;
    let radii = cloud.radius.par_iter_mut().zip(&cloud.footprint).with_min_len(CHUNK);
    radii.for_each(|(radius, id)| *radius *= wider(*id));
    let tangents = cloud.tangent.par_iter_mut().zip(&cloud.footprint).with_min_len(CHUNK);
    tangents.for_each(|(tangent, id)| *tangent *= wider(*id));
    let is_image = |id: u8| choice.stack.image(id.into()).is_some();
    if !cloud.footprint.par_iter().with_min_len(CHUNK).any(|id| is_image(*id)) {
        return Ok(());
    }
    cloud.tangent.resize(cloud.position.len(), Vec3::ZERO);
    let discs = (&mut cloud.tangent, &cloud.normal, &cloud.radius, &cloud.footprint).into_par_iter();
    discs.with_min_len(CHUNK).enumerate().for_each(|(i, (tangent, normal, radius, id))| {
        if is_image(*id) && *tangent == Vec3::ZERO {
            let turn = choice.turn * (2.0 * rng::unit(choice.seed, TURN, key(i), 0) - 1.0);
            *tangent = (right_of(normal.as_dvec3(), turn) * f64::from(*radius)).as_vec3();
        }
    });
    Ok(())
}

/// The same by the places of the discs themselves, as they lie about the object's origin: they move with the object, and turned or scaled
/// it is another one.
pub(crate) fn choose_by_place(cloud: &mut Cloud, params: &SplatParams) -> Result<(), ConvertError> {
    if params.footprints.as_ref().is_none_or(|choice| choice.is_one_formula()) {
        return Ok(());
    }
    let places = cloud.position.clone();
    choose_footprints(cloud, params, |i| places[i], None)
}

/// Refuses images for what is no disc.
pub(crate) fn check_kind(kind: SplatKind, params: &SplatParams) -> Result<(), ConvertError> {
    if kind == SplatKind::Medium && params.shows_images() {
        let expected = "a formula for a medium: an image lies in the plane of a disc";
        return Err(params.bad_text("footprint", "an image".to_owned(), expected));
    }
    Ok(())
}

/// Where the right side of an image points on a disc, a unit vector.
fn right_of(normal: DVec3, turn: f64) -> DVec3 {
    let across = DVec3::Y.cross(normal);
    let flat = across.length() < FLAT;
    let right = if flat { DVec3::X - normal * normal.x } else { across }.normalize();
    if turn == 0.0 {
        return right;
    }
    let (sin, cos) = libm::sincos(turn);
    right * cos + normal.cross(right) * sin
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_stand_upright_and_turn_about_the_normal() {
        for normal in [DVec3::Z, -DVec3::Z, DVec3::X, DVec3::new(0.48, 0.6, -0.64)] {
            let right = right_of(normal, 0.0);
            assert!(right.y.abs() < 1e-15 && normal.cross(right).y > 0.0, "{normal}");
            let turned = right_of(normal, 0.5);
            assert!((turned.dot(right) - 0.5f64.cos()).abs() < 1e-15 && turned.dot(normal).abs() < 1e-15, "{normal}");
        }
        assert_eq!(right_of(DVec3::Y, 0.0), DVec3::X);
    }
}
