//! The forms in which techniques take objects: neutral, so that whatever reads and converts knows no technique.

use crate::scene::Technique;

/// The form in which a technique draws an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Opaque splats, which the frame draws.
    Opaque,
    /// A field whose zero set random lines find.
    Lines,
    /// An isosurface of a volume, found along its lattice.
    Lattice,
    /// A field on whose zero set a Brownian motion goes.
    Brownian,
    /// Triangles.
    Triangles,
    /// A lattice with a transfer function, or of extinction.
    Cells,
    /// The same, through which chains of places go.
    Chains,
    /// A field of extinction.
    Field,
    /// Opaque triangles, which their technique lights itself.
    Polygons,
    /// Translucent triangles, which part the slabs that they lie in.
    Panes,
    /// Splats.
    Splats,
}

impl Form {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Opaque => "none",
            Self::Lines => "lines",
            Self::Lattice => "lattice lines",
            Self::Brownian => "brownian",
            Self::Triangles => "triangles",
            Self::Cells => "cells",
            Self::Chains => "metropolis",
            Self::Field => "field",
            Self::Polygons | Self::Panes => "polygons",
            Self::Splats => "splats",
        }
    }

    /// Whether triangles stay what they are.
    pub fn is_polygons(self) -> bool {
        matches!(self, Self::Polygons | Self::Panes)
    }

    /// Whether it is the object's native data, not its splats.
    pub fn is_own(self) -> bool {
        !matches!(self, Self::Opaque | Self::Splats)
    }
}

/// The planned technique and form of an object, with the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedObject {
    /// Name of the object.
    pub object: String,
    /// The technique that draws it.
    pub technique: Technique,
    /// The form in which it is drawn.
    pub form: Form,
    /// Why from that.
    pub reason: &'static str,
    /// Why the object becomes splats; `None` where it does not.
    pub splats: Option<&'static str>,
}

impl PlannedObject {
    /// Whether it becomes splats that are drawn as they are.
    pub fn is_drawn_as_splats(&self) -> bool {
        self.splats == Some(DRAWN)
    }
}

/// Why splats are made that are drawn.
pub(crate) const DRAWN: &str = "they are drawn";
