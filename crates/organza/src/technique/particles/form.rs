//! The form from which the particles of an object are sampled.
//!
//! An object is sampled from its native data if a sampler accepts them, and from its splats if those are the data (raw
//! points).

use crate::form::Form;
use crate::scene::{SurfaceSampler, VolumeSampler};
use crate::statistics::{ObjectData, ObjectStatistics};

/// Looseness of a field's bound above which triangles are faster than lines.
const LOOSEST: f64 = 4.2;

pub(crate) fn form(object: &ObjectStatistics) -> (Form, &'static str) {
    if object.opaque {
        return (Form::Opaque, "an opaque surface is drawn exactly");
    }
    match object.data {
        ObjectData::Points | ObjectData::Gaussians => {
            (Form::Splats, "raw points have nothing between them, and fields are shown by splats")
        }
        ObjectData::Triangles if object.is_partly_opaque => {
            (Form::Splats, "its opaque parts are drawn exactly, as opaque splats")
        }
        ObjectData::Triangles => (Form::Triangles, "a uniform place on a triangle is exact"),
        ObjectData::Surface { looseness, on_lattice, by } => surface(looseness, on_lattice, by),
        ObjectData::Volume | ObjectData::Density { .. } if object.volumes_by != VolumeSampler::Auto => {
            let by_cells = object.volumes_by == VolumeSampler::Cells;
            (if by_cells { Form::Cells } else { Form::Chains }, "the scene asks for it")
        }
        ObjectData::Volume => (Form::Cells, "extinction is known on a lattice"),
        ObjectData::Density { bounded: false } => {
            (Form::Cells, "the expression has no bound, so it is sampled on a lattice")
        }
        ObjectData::Density { .. } if object.by_gradient => {
            (Form::Cells, "it is shaded by its gradient, which a lattice gives")
        }
        ObjectData::Density { .. } => (Form::Field, "extinction has a bound wherever it is asked for"),
    }
}

fn surface(looseness: f64, on_lattice: bool, by: SurfaceSampler) -> (Form, &'static str) {
    match by {
        SurfaceSampler::Auto if on_lattice => {
            (Form::Lattice, "lines along a lattice meet an isosurface in the roots of a polynomial")
        }
        SurfaceSampler::Auto if looseness > LOOSEST => {
            (Form::Triangles, "its field has a loose bound, so that lines would search long: it is meshed")
        }
        SurfaceSampler::Auto => (Form::Lines, "random lines meet a surface uniformly, without a mesh of it"),
        SurfaceSampler::Lines => (Form::Lines, "the scene asks for it"),
        SurfaceSampler::Triangles => (Form::Triangles, "the scene asks for it"),
        SurfaceSampler::Brownian { .. } => (Form::Brownian, "the scene asks for it"),
    }
}
