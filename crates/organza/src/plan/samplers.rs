//! Where the particles of each object come from, and which objects become splats beside that.
//!
//! An object is sampled from its own data wherever a sampler knows them. It becomes splats only where splats are drawn
//! (opaque surfaces), where they are the data (raw points), or where a shadow map may need them.

use crate::scene::SurfaceSampler;
use crate::statistics::{LightStatistics, ObjectData, ObjectStatistics};

/// Looseness of a field's bound above which triangles are faster than lines.
const LOOSEST: f64 = 4.2;

/// Where particles come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParticleSource {
    /// Nowhere: opaque splats are drawn as they are.
    Opaque,
    /// Random lines through a field.
    Lines,
    /// Lines along the lattice of a volume.
    Lattice,
    /// A Brownian motion on the zero set of a field.
    Brownian,
    /// Triangles.
    Triangles,
    /// Cells of a volume.
    Cells,
    /// A field of extinction.
    Field,
    /// Splats.
    Splats,
}

impl ParticleSource {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Opaque => "none",
            Self::Lines => "lines",
            Self::Lattice => "lattice lines",
            Self::Brownian => "brownian",
            Self::Triangles => "triangles",
            Self::Cells => "cells",
            Self::Field => "field",
            Self::Splats => "splats",
        }
    }

    /// Whether particles are sampled from the object's own data.
    pub fn is_own(self) -> bool {
        !matches!(self, Self::Opaque | Self::Splats)
    }
}

/// The source of one object's particles, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedSampler {
    /// Name of the object.
    pub object: String,
    /// Where its particles come from.
    pub source: ParticleSource,
    /// Why from there.
    pub reason: &'static str,
    /// Why the object becomes splats; `None` where it does not.
    pub splats: Option<&'static str>,
}

/// One sampler for each object.
pub fn samplers(objects: &[ObjectStatistics], lights: &[LightStatistics]) -> Vec<PlannedSampler> {
    let shining = lights.iter().any(|l| l.wants_shadow && !l.is_dark);
    let shadows = shining && objects.iter().any(|o| o.receives);
    objects.iter().map(|o| sampler(o, shadows)).collect()
}

fn sampler(object: &ObjectStatistics, shadows: bool) -> PlannedSampler {
    let (source, reason) = source(object);
    let splats = match source {
        ParticleSource::Opaque => Some("they are drawn"),
        ParticleSource::Splats => Some("particles are sampled from them"),
        _ if shadows && object.casts => Some("they may cast a shadow"),
        _ => None,
    };
    PlannedSampler { object: object.name.clone(), source, reason, splats }
}

fn source(object: &ObjectStatistics) -> (ParticleSource, &'static str) {
    if object.opaque {
        return (ParticleSource::Opaque, "an opaque surface is drawn exactly");
    }
    match object.data {
        ObjectData::Points => (ParticleSource::Splats, "there is nothing between raw points"),
        ObjectData::Triangles => (ParticleSource::Triangles, "a uniform place on a triangle is exact"),
        ObjectData::Surface { looseness, trilinear, by } => surface(looseness, trilinear, by),
        ObjectData::Volume => (ParticleSource::Cells, "extinction is known on a lattice"),
        ObjectData::Density { bounded: false } => {
            (ParticleSource::Cells, "the expression has no bound, so it is sampled on a lattice")
        }
        ObjectData::Density { .. } if object.by_gradient => {
            (ParticleSource::Cells, "it is shaded by its gradient, which a lattice gives")
        }
        ObjectData::Density { .. } => (ParticleSource::Field, "extinction has a bound wherever it is asked for"),
    }
}

fn surface(looseness: f64, trilinear: bool, by: SurfaceSampler) -> (ParticleSource, &'static str) {
    match by {
        SurfaceSampler::Auto if trilinear => {
            (ParticleSource::Lattice, "lines along a lattice meet a trilinear surface in closed form")
        }
        SurfaceSampler::Auto if looseness > LOOSEST => {
            (ParticleSource::Triangles, "its field has a loose bound, so that lines would search long: it is meshed")
        }
        SurfaceSampler::Auto => (ParticleSource::Lines, "random lines meet a surface uniformly, without a mesh of it"),
        SurfaceSampler::Lines => (ParticleSource::Lines, "the scene asks for it"),
        SurfaceSampler::Triangles => (ParticleSource::Triangles, "the scene asks for it"),
        SurfaceSampler::Brownian { .. } => (ParticleSource::Brownian, "the scene asks for it"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(data: ObjectData) -> ObjectStatistics {
        ObjectStatistics {
            name: "a".into(),
            data,
            opaque: false,
            by_gradient: false,
            casts: true,
            receives: true,
            splats: 7,
        }
    }

    const SUN: LightStatistics = LightStatistics { wants_shadow: true, is_dark: false };

    #[test]
    fn every_kind_of_data_has_its_sampler() {
        let of = |o: ObjectStatistics| samplers(&[o], &[])[0].source;
        assert_eq!(of(object(ObjectData::Points)), ParticleSource::Splats);
        assert_eq!(of(object(ObjectData::Triangles)), ParticleSource::Triangles);
        let surface = |looseness, by| object(ObjectData::Surface { looseness, trilinear: false, by });
        let auto = |looseness| surface(looseness, SurfaceSampler::Auto);
        assert_eq!(of(auto(2.6)), ParticleSource::Lines);
        assert_eq!(of(auto(f64::INFINITY)), ParticleSource::Triangles);
        assert_eq!(of(surface(f64::INFINITY, SurfaceSampler::Lines)), ParticleSource::Lines);
        assert_eq!(of(surface(2.6, SurfaceSampler::Triangles)), ParticleSource::Triangles);
        assert_eq!(of(surface(2.6, SurfaceSampler::Brownian { step: 0.01 })), ParticleSource::Brownian);
        let trilinear = |by| of(object(ObjectData::Surface { looseness: 0.0, trilinear: true, by }));
        assert_eq!(trilinear(SurfaceSampler::Auto), ParticleSource::Lattice);
        assert_eq!(trilinear(SurfaceSampler::Lines), ParticleSource::Lines);
        assert_eq!(of(object(ObjectData::Volume)), ParticleSource::Cells);
        assert_eq!(of(object(ObjectData::Density { bounded: true })), ParticleSource::Field);
        assert_eq!(of(object(ObjectData::Density { bounded: false })), ParticleSource::Cells);
        let lit = ObjectStatistics { by_gradient: true, ..object(ObjectData::Density { bounded: true }) };
        assert_eq!(of(lit), ParticleSource::Cells);
        assert_eq!(of(ObjectStatistics { opaque: true, ..auto(2.6) }), ParticleSource::Opaque);
    }

    #[test]
    fn x7_only_casters_become_splats_and_only_for_a_light_and_a_receiver() {
        let mesh = object(ObjectData::Triangles);
        let splats = |objects: &[ObjectStatistics], lights: &[LightStatistics]| -> Vec<bool> {
            samplers(objects, lights).iter().map(|s| s.splats.is_some()).collect()
        };
        let shy = ObjectStatistics { casts: false, ..mesh.clone() };
        assert_eq!(splats(&[mesh.clone(), shy.clone()], &[SUN]), [true, false]);
        assert_eq!(splats(&[mesh.clone(), shy.clone()], &[]), [false, false]);
        for light in [LightStatistics { is_dark: true, ..SUN }, LightStatistics { wants_shadow: false, ..SUN }] {
            assert_eq!(splats(&[mesh.clone(), shy.clone()], &[light]), [false, false]);
        }
        let deaf = ObjectStatistics { receives: false, ..mesh };
        assert_eq!(splats(&[deaf.clone(), deaf], &[SUN]), [false, false]);
    }
}
