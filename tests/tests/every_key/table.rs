//! A value for every key that must change what is seen, and where it must not, with the reason.

use super::scenes::SOURCES;
use super::{fields, footprints, lights, seen, surfels};

/// Where a change is looked for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Look {
    /// The bits of beauty.
    Picture,
    /// The names of the layers.
    Layers,
    /// The PNG file.
    Displayed,
    /// What the passes made.
    Work,
    /// Sets of particles that were averaged.
    Sets,
    /// Objects, frames and effects, as `explain` names them.
    Told,
}

/// What a changed value does.
#[derive(Clone, Copy)]
pub(crate) enum Expected {
    Changes,
    /// Refused with an exit code and these words.
    Refused(u8, &'static str),
    /// Nothing by its nature, and why.
    Nothing(&'static str),
}

use Expected::{Nothing, Refused};

/// A key and its trial.
pub(crate) struct Entry {
    pub(crate) key: &'static str,
    /// The trial, as for `--set`.
    pub(crate) set: &'static str,
    /// What the scene has before and after.
    pub(crate) with: &'static [&'static str],
    pub(crate) look: Look,
    pub(crate) frame: Option<u32>,
    pub(crate) techniques: &'static [&'static str],
    /// Sources that it is tried with.
    sources: Which,
    /// Other outcomes than a change: of these sources, and by these techniques.
    but: Vec<(Which, &'static [&'static str], Expected)>,
}

/// Sources.
#[derive(Clone, Copy)]
pub(crate) enum Which {
    All,
    Media,
    These(&'static [&'static str]),
}

use Which::{All, Media, These};

impl Which {
    fn has(self, source: &str) -> bool {
        let is_medium = SOURCES.iter().any(|s| s.name == source && s.is_medium);
        match self {
            All => true,
            Media => is_medium,
            These(names) => names.contains(&source),
        }
    }
}

const EACH: &[&str] = &["points", "particles", "sheets", "surfels"];
pub(super) const POINTS: &[&str] = &["points"];
const PARTICLES: &[&str] = &["particles"];
const SHEETS: &[&str] = &["sheets"];
pub(super) const SURFELS: &[&str] = &["surfels"];
const BUT_POINTS: &[&str] = &["particles", "sheets", "surfels"];
const BUT_PARTICLES: &[&str] = &["points", "sheets", "surfels"];

impl Entry {
    /// Whether it is tried with a source by a technique. What is no medium is splats for sheets and surfels as for points: one such
    /// source stands for all. Surfels refuse media.
    pub(crate) fn applies_to(&self, source: &str, technique: &str) -> bool {
        let by_technique = match technique {
            "sheets" => Media.has(source) || source == "implicit",
            "surfels" => source == "implicit" || source == "plain points",
            _ => true,
        };
        self.sources.has(source) && by_technique
    }

    pub(crate) fn expected(&self, source: &str, technique: &str) -> Expected {
        let applies = |(which, by, _): &&(Which, &[&str], Expected)| which.has(source) && by.contains(&technique);
        self.but.iter().find(applies).map_or(Expected::Changes, |b| b.2)
    }

    pub(super) fn with(self, with: &'static [&'static str]) -> Self {
        Self { with, ..self }
    }

    pub(super) fn look(self, look: Look) -> Self {
        Self { look, ..self }
    }

    pub(super) fn by(self, techniques: &'static [&'static str]) -> Self {
        Self { techniques, ..self }
    }

    pub(super) fn at(self, frame: u32) -> Self {
        Self { frame: Some(frame), ..self }
    }

    fn but(mut self, which: Which, expected: Expected) -> Self {
        self.but.push((which, EACH, expected));
        self
    }

    fn but_by(mut self, techniques: &'static [&'static str], expected: Expected) -> Self {
        self.but.push((All, techniques, expected));
        self
    }
}

/// A trial with some sources.
pub(super) fn of(sources: Which, key: &'static str, set: &'static str) -> Entry {
    let with = &[][..];
    let but = Vec::new();
    Entry { key, set, with, look: Look::Picture, frame: None, techniques: EACH, sources, but }
}

/// A trial with one source.
pub(super) fn one(key: &'static str, set: &'static str) -> Entry {
    of(These(&["implicit"]), key, set)
}

pub(crate) fn entries() -> Vec<Entry> {
    let first = [scene(), footprints::entries(), lights::entries(), objects()];
    let others =
        [sources(), fields::entries(), seen::entries(), materials(), render(), surfels::entries(), animation()];
    first.into_iter().chain(others).flatten().collect()
}

fn scene() -> Vec<Entry> {
    vec![
        one("version", "version=2").but(All, Refused(2, "expected 1")),
        one("camera", "camera={position=[1, 0, 4], target=[0, 0, 0], size=[24, 18]}"),
        one("camera.position", "camera.position=[0.5, 0.4, 4]"),
        one("camera.target", "camera.target=[0.1, 0, 0]"),
        one("camera.up", "camera.up=[1, 0, 0]"),
        one("camera.fov_y", "camera.fov_y=50"),
        one("camera.orthographic", "camera.orthographic=2"),
        one("camera.size", "camera.size=[30, 18]"),
        one("camera.auto", "camera={auto=true, size=[24, 18]}"),
        one("camera.azimuth", "camera.azimuth=80").with(AUTO),
        one("camera.elevation", "camera.elevation=60").with(AUTO),
        one("camera.fit", "camera.fit=0.5").with(AUTO),
        one("root", "root='nowhere'").but(All, Refused(2, "expected a folder")),
        one("background", "background={color=[1, 0, 0]}"),
        one("background.color", "background.color=[1, 0, 0]"),
        one("background.environment", "background={environment='sky.hdr'}"),
        one("background.rotate", "background.rotate=90").with(SKY),
        one("background.scale", "background.scale=2").with(SKY),
        one("ambient", "ambient={color=[1, 0, 0]}"),
        one("ambient.color", "ambient.color=[1, 0, 0]"),
        of(All, "footprints", "footprints=[2]"),
        one("material", "material={m={opacity=0.9}}"),
    ]
}

const AUTO: &[&str] = &["camera={auto=true, size=[24, 18]}"];
const SKY: &[&str] = &["background={environment='sky.hdr'}"];
pub(super) const SPOT: &[&str] =
    &["light=[{kind='spot', position=[2, 3, 2], target=[0, 0, 0], outer=20, intensity=[20, 18, 16]}]"];
pub(super) const SUN: &[&str] = &["light=[{kind='directional', direction=[-2, -3, -2], irradiance=[2, 1.8, 1.6]}]"];

const OF_THE_TRANSFER: Expected = Refused(2, "are those of its `transfer`");
const NOT_OF_POINTS: Expected = Refused(2, "`merge_duplicates` belongs to `points`");
const RAW: Which = These(&["points", "plain points"]);
const MESHES: Which = These(&["mesh", "plain mesh"]);
const BY_Z: &[&str] = &["object.it.color_by={column='z'}"];
const HOT: &[&str] = &["object.it.points='hot.xyz'", "object.it.color_by={column='heat'}"];
const LABELS: &[&str] = &["object.it.mesh='labels.nrrd'", "object.it.labels={1={opacity=0.9}}"];
const MATTER: &[&str] = &["object.it.as='medium'", "object.it.extinction=3"];
const OWN_SPACING: Expected = Refused(2, "states its own spacing");
const NO_TRANSFER: Expected = Refused(2, "belongs to a `volume` or `slice`, to a surface with a `field`, and");
pub(super) const OPEN: Which = These(&["implicit", "isosurface", "level_set", "union"]);

fn objects() -> Vec<Entry> {
    vec![
        one("object", "object=[]"),
        of(All, "object.name", "object.2.name='else'").look(Look::Told),
        of(All, "object.transform", "object.it.transform={translate=[0.1, 0, 0]}"),
        of(All, "object.transform.scale", "object.it.transform.scale=0.8"),
        of(All, "object.transform.rotate", "object.it.transform.rotate=[20, 30, 0]"),
        of(All, "object.transform.translate", "object.it.transform.translate=[0.1, 0, 0]"),
        of(All, "object.transform.up", "object.it.transform.up='z'"),
        of(All, "object.material", "object.it.material='other'"),
        of(All, "object.opacity", "object.it.opacity=0.9").but(Media, Refused(2, "a medium has no `opacity`")),
        of(All, "object.color", "object.it.color=[0.1, 0.9, 0.3]").but(These(&["volume", "slice"]), OF_THE_TRANSFER),
        of(All, "object.spacing", "object.it.spacing=0.16")
            .but(These(&["density", "cloud", "rectangle", "medium_box", "medium_ball"]), OWN_SPACING),
        of(VOLUME, "object.lattice", "object.it.lattice='bcc'")
            .but_by(&["points", "particles"], Refused(2, "draws no body-centred lattice")),
        one("object.lattice", "object.it.lattice='bcc'").but(All, Refused(2, "`lattice` belongs to a `volume`")),
        of(VOLUME, "object.frame", "object.it.frame=1").with(&["object.it.volume='series.nrrd'"]),
        one("object.frame", "object.it.frame=1").but(All, Refused(2, "`frame` belongs to a `volume`")),
        of(VOLUME, "object.array", "object.it.array='other'").with(&["object.it.volume='arrays.vtk'"]),
        one("object.array", "object.it.array='other'").but(All, Refused(2, "`array` belongs to a `volume`")),
        of(VOLUME, "object.voxel_size", "object.it.voxel_size=[0.15, 0.2, 0.2]"),
        one("object.voxel_size", "object.it.voxel_size=[1, 1, 2]")
            .but(All, Refused(2, "`voxel_size` belongs to a `volume`")),
        of(VOLUME, "object.nodata", "object.it.nodata=1"),
        one("object.nodata", "object.it.nodata=1").but(All, Refused(2, "`nodata` belongs to a `volume`")),
        of(All, "object.shadow_coefficient", "object.it.shadow_coefficient=0.2"),
        one("object.technique", "object.it.technique='reference'"),
        of(All, "object.casts_shadow", "object.it.casts_shadow=false"),
        of(All, "object.visible", "object.it.visible=false"),
        of(All, "object.footprint", "object.it.footprint=2"),
        of(All, "object.merge_duplicates", "object.it.merge_duplicates=true")
            .look(Look::Told)
            .but(These(&["points", "plain points"]), Expected::Changes)
            .but(All, NOT_OF_POINTS),
        of(All, "object.clip", "object.it.clip=[{normal=[0, 1, 0], point=[0, 0.1, 0]}]"),
        of(OPEN, "object.clip.normal", "object.it.clip.0.normal=[1, 0, 0]")
            .with(&["object.it.clip=[{normal=[0, 1, 0], point=[0, 0.1, 0]}]"]),
        of(OPEN, "object.clip.point", "object.it.clip.0.point=[0, -0.1, 0]")
            .with(&["object.it.clip=[{normal=[0, 1, 0], point=[0, 0.1, 0]}]"]),
        of(OPEN, "object.clip.box", "object.it.clip.0.box=[[-0.2, -0.3, -1], [0.3, 0.3, 1]]")
            .with(&["object.it.clip=[{box=[[-0.3, -0.3, -1], [0.3, 0.3, 1]]}]"]),
        of(RAW, "object.as", "object.it.as='medium'").with(&["material.m.medium={extinction=3}"]).by(POINTS),
        of(RAW, "object.extinction", "object.it.extinction=1").with(MATTER).by(POINTS),
        one("object.materials", "object.it.materials=['m']").but(All, Refused(2, "belongs to `points` that are")),
        of(RAW, "object.color_by", "object.it.color_by={column='z'}"),
        of(MESHES, "object.color_by", "object.it.color_by={column='z'}"),
        of(MESHES, "object.color_by.column", "object.it.color_by.column='x'").with(BY_Z),
        of(MESHES, "object.color_by.map", "object.it.color_by.map='turbo'").with(BY_Z),
        of(MESHES, "object.color_by.range", "object.it.color_by.range=[-9, 9]").with(BY_Z),
        of(MESHES, "object.color_by.scale", "object.it.color_by.scale='log'").with(BY_Z),
        one("object.color_by", "object.it.color_by={column='z'}")
            .but(All, Refused(2, "`color_by` belongs to `points`")),
        of(MESHES, "object.labels", "object.it.labels='labels.toml'").with(LABELS),
        of(MESHES, "object.labels.table", "object.it.labels.table='labels.toml'").with(LABELS),
        of(MESHES, "object.labels.name", "object.it.labels.1.name='one'")
            .with(LABELS)
            .but(All, Nothing("a legend alone has names")),
        of(MESHES, "object.labels.color", "object.it.labels.1.color='#ff2000'").with(LABELS),
        of(MESHES, "object.labels.opacity", "object.it.labels.1.opacity=0.2").with(LABELS),
        of(MESHES, "object.labels.visible", "object.it.labels.1.visible=false").with(LABELS),
        one("object.labels", "object.it.labels={1='one'}").but(All, Refused(2, "`labels` belongs to a `mesh`")),
        of(HEAT, "object.color_by.column", "object.it.color_by.column='x'").with(HOT),
        of(HEAT, "object.color_by.map", "object.it.color_by.map='distinct'").with(HOT),
        of(HEAT, "object.color_by.range", "object.it.color_by.range=[0, 900]").with(HOT),
        of(HEAT, "object.color_by.scale", "object.it.color_by.scale='log'").with(HOT),
        of(HEAT, "object.keep", "object.it.keep={heat=[10, 200]}").with(HOT),
        one("object.keep", "object.it.keep={z=[0, 1]}").but(All, Refused(2, "`keep` belongs to `points`")),
        of(RAW, "object.unlit", "object.it.unlit=true")
            .but(All, Refused(2, "`unlit` and `material` exclude each other")),
        one("object.unlit", "object.it.unlit=true").but(All, Refused(2, "`unlit` belongs to `points`")),
        of(RAW, "object.degrees", "object.it.degrees=true"),
        one("object.degrees", "object.it.degrees=true").but(All, Refused(2, "`degrees` belongs to `points`")),
        of(RAW, "object.point_size", "object.it.point_size={world=0.05}"),
        one("object.point_size", "object.it.point_size={world=0.05}")
            .but(All, Refused(2, "`point_size` belongs to `points`")),
        of(RAW, "object.discs", "object.it.discs='elliptical'"),
        of(RAW, "object.discs", "object.it.discs='balls'"),
        one("object.discs", "object.it.discs='elliptical'").but(All, Refused(2, "`discs` belongs to `points`")),
        of(HEAT, "object.point_size.world", "object.it.point_size.world=0.05")
            .with(&["object.it.point_size={world=0.1}"]),
        of(HEAT, "object.point_size.pixels", "object.it.point_size.pixels=1")
            .with(&["object.it.point_size={pixels=2}"]),
    ]
}

const HEAT: Which = These(&["plain points"]);

const CLOUD: Which = These(&["cloud"]);
const VOLUME: Which = These(&["volume"]);
const OPACITIES: &[&str] = &[
    "object.it.unit_length=0.5",
    "object.it.transfer=[{value=0, color=[1, 0.5, 0.2], opacity=0.1}, {value=1, color=[0.2, 0.6, 1], opacity=0.8}]",
];

fn sources() -> Vec<Entry> {
    vec![
        of(These(&["mesh"]), "object.mesh", "object.it.mesh='other.ply'"),
        of(These(&["points"]), "object.points", "object.it.points='other.xyz'"),
        of(VOLUME, "object.volume", "object.it.volume='other.nrrd'"),
        of(All, "object.transfer", "object.it.transfer=[{value=0, color=[1, 0, 0], extinction=1}]")
            .but(VOLUME, Expected::Changes)
            .but(These(&["slice"]), Refused(2, "a slice has no extinction"))
            .but(All, NO_TRANSFER),
        of(VOLUME, "object.transfer.value", "object.it.transfer.1.value=0.7"),
        of(These(&["volume", "slice"]), "object.transfer.color", "object.it.transfer.1.color=[1, 0, 0]"),
        of(VOLUME, "object.transfer.extinction", "object.it.transfer.1.extinction=2"),
        of(VOLUME, "object.transfer.opacity", "object.it.transfer.1.opacity=0.5").with(OPACITIES),
        of(VOLUME, "object.unit_length", "object.it.unit_length=0.3").with(OPACITIES),
        of(These(&["slice"]), "object.slice", "object.it.slice={volume='grid.nrrd', center=[0, 0, 0.2], normal=[0, 0, 1]}"),
        of(These(&["slice"]), "object.slice.volume", "object.it.slice.volume='other.nrrd'"),
        of(These(&["slice"]), "object.slice.frame", "object.it.slice.frame=1")
            .with(&["object.it.slice.volume='series.nrrd'"]),
        of(These(&["slice"]), "object.slice.center", "object.it.slice.center=[0, 0, 0.2]"),
        of(These(&["slice"]), "object.slice.normal", "object.it.slice.normal=[0.5, 0.3, 1]"),
        of(These(&["density"]), "object.density", "object.it.density={expression='1', box=[[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], resolution=10}"),
        of(These(&["density"]), "object.density.expression", "object.it.density.expression='1'"),
        of(These(&["density"]), "object.density.box", "object.it.density.box=[[-0.6, -0.6, -0.6], [0.3, 0.6, 0.6]]"),
        of(These(&["density"]), "object.density.resolution", "object.it.density.resolution=7"),
        of(These(&["density"]), "object.density.spacing", "object.it.density.spacing=0.2").with(&["object.it.density={expression='1.2 + x - y - 2*z', box=[[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], spacing=0.12}"]),
        of(These(&["density"]), "object.density.extinction", "object.it.density.extinction=1"),
        of(CLOUD, "object.cloud", "object.it.cloud={ellipsoids=[{center=[0, 0, 0], radii=[0.5, 0.5, 0.5]}], spacing=0.12}"),
        of(CLOUD, "object.cloud.ellipsoids", "object.it.cloud.ellipsoids=[{center=[0, 0, 0], radii=[0.5, 0.5, 0.5]}]"),
        of(CLOUD, "object.cloud.ellipsoids.center", "object.it.cloud.ellipsoids.0.center=[0.1, 0, 0]"),
        of(CLOUD, "object.cloud.ellipsoids.radii", "object.it.cloud.ellipsoids.0.radii=[0.5, 0.5, 0.5]"),
        of(CLOUD, "object.cloud.octaves", "object.it.cloud.octaves=2"),
        of(CLOUD, "object.cloud.frequency", "object.it.cloud.frequency=2"),
        of(CLOUD, "object.cloud.amplitude", "object.it.cloud.amplitude=0.1"),
        of(CLOUD, "object.cloud.seed", "object.it.cloud.seed=7"),
        of(CLOUD, "object.cloud.spacing", "object.it.cloud.spacing=0.2"),
        of(CLOUD, "object.cloud.extinction", "object.it.cloud.extinction=1"),
        of(These(&["rectangle"]), "object.rectangle", "object.it.rectangle={center=[0.1, 0, 0], u=[0.6, 0, 0], v=[0, 0.5, 0], spacing=0.1}"),
        of(These(&["rectangle"]), "object.rectangle.center", "object.it.rectangle.center=[0.1, 0, 0]"),
        of(These(&["rectangle"]), "object.rectangle.u", "object.it.rectangle.u=[0.4, 0, 0.2]"),
        of(These(&["rectangle"]), "object.rectangle.v", "object.it.rectangle.v=[0, 0.4, 0.1]"),
        of(These(&["rectangle"]), "object.rectangle.spacing", "object.it.rectangle.spacing=0.2"),
        of(These(&["medium_box"]), "object.medium_box", "object.it.medium_box={min=[-0.5, -0.4, -0.5], max=[0.2, 0.6, 0.5], spacing=0.12}"),
        of(These(&["medium_box"]), "object.medium_box.min", "object.it.medium_box.min=[-0.2, -0.4, -0.5]"),
        of(These(&["medium_box"]), "object.medium_box.max", "object.it.medium_box.max=[0.2, 0.6, 0.5]"),
        of(These(&["medium_box"]), "object.medium_box.extinction", "object.it.medium_box.extinction=1"),
        of(These(&["medium_box"]), "object.medium_box.spacing", "object.it.medium_box.spacing=0.2"),
        of(These(&["medium_ball"]), "object.medium_ball", "object.it.medium_ball={center=[0.1, 0, 0], radius=0.6, spacing=0.12}"),
        of(These(&["medium_ball"]), "object.medium_ball.center", "object.it.medium_ball.center=[0.1, 0, 0]"),
        of(These(&["medium_ball"]), "object.medium_ball.radius", "object.it.medium_ball.radius=0.4"),
        of(These(&["medium_ball"]), "object.medium_ball.extinction", "object.it.medium_ball.extinction=1"),
        of(These(&["medium_ball"]), "object.medium_ball.spacing", "object.it.medium_ball.spacing=0.2"),
    ]
}

const HAS_COLORS: Which = These(&["mesh", "points", "volume", "slice"]);
const OF_SURFACES: Expected = Nothing("a key of surfaces");
const HOMOGENEOUS: Which = These(&["medium_box", "medium_ball"]);
const NO_NORMAL: Expected = Nothing("a homogeneous medium has no gradient, which Phong's model needs");
const PHONG: &[&str] = &["material.m.shading='phong'"];
const BROAD: &[&str] = &["material.m.shading='phong'", "material.m.shininess=1"];
const SHINY: &[&str] = &["material.m.shading='phong'", "material.m.shininess=1", "material.m.specular=0.9"];
const ABSORPTION: &[&str] =
    &["material.m.absorption={kappa=[0.01, 0.02, 0.03], wavelength=[0.2, 0.2, 0.2]}", "material.m.medium={albedo=0.8}"];

fn materials() -> Vec<Entry> {
    vec![
        of(All, "material.color", "material.m.color=[0.1, 0.9, 0.3]")
            .but(HAS_COLORS, Nothing("it is the colour of data that has none")),
        of(All, "material.opacity", "material.m.opacity=0.9").but(Media, OF_SURFACES),
        of(All, "material.surface_opacity", "material.m.surface_opacity='thin_slab'").but(Media, OF_SURFACES),
        of(All, "material.shading", "material.m.shading='unlit'"),
        of(All, "material.ambient", "material.m.ambient=0.2"),
        of(All, "material.diffuse", "material.m.diffuse=0.3").with(PHONG).but(HOMOGENEOUS, NO_NORMAL),
        of(All, "material.specular", "material.m.specular=0.9").with(BROAD).but(HOMOGENEOUS, NO_NORMAL),
        of(All, "material.shininess", "material.m.shininess=2").with(SHINY).but(HOMOGENEOUS, NO_NORMAL),
        of(All, "material.transmission", "material.m.transmission=0.6").with(PHONG).but(HOMOGENEOUS, NO_NORMAL),
        of(All, "material.emission", "material.m.emission=[0.5, 0.1, 0]"),
        of(All, "material.extinction_rgb", "material.m.extinction_rgb=[1, 0.5, 0.2]"),
        of(All, "material.medium", "material.m.medium={albedo=0.3, extinction=2}"),
        of(Media, "material.medium.extinction", "material.m.medium.extinction=1")
            .but(VOLUME, Nothing("`transfer` states it")),
        of(Media, "material.medium.albedo", "material.m.medium.albedo=0.2"),
        of(Media, "material.medium.asymmetry", "material.m.medium.asymmetry=-0.5"),
        of(
            Media,
            "material.absorption",
            "material.m.absorption={kappa=[0.05, 0.02, 0.03], wavelength=[0.2, 0.2, 0.2]}",
        )
        .with(ABSORPTION),
        of(Media, "material.absorption.kappa", "material.m.absorption.kappa=[0.05, 0.02, 0.03]").with(ABSORPTION),
        of(Media, "material.absorption.wavelength", "material.m.absorption.wavelength=[0.2, 0.3, 0.4]")
            .with(ABSORPTION),
        of(OPEN, "material.ior", "material.m.ior=1.5").but_by(BUT_SURFELS, UNBENT),
        of(OPEN, "material.cauchy", "material.m.cauchy={a=1.3, b=0.1}").but_by(BUT_SURFELS, UNBENT),
        of(OPEN, "material.cauchy.a", "material.m.cauchy.a=1.5").by(SURFELS).with(CAUCHY),
        of(OPEN, "material.cauchy.b", "material.m.cauchy.b=0").by(SURFELS).with(CAUCHY),
        of(OPEN, "material.absorption_inside", "material.m.absorption_inside=[1, 2, 3]").but_by(BUT_SURFELS, UNBENT),
        of(OPEN, "material.half_length", "material.m.half_length=[1, 2, 3]").but_by(BUT_SURFELS, UNBENT),
        of(All, "material.preset", "material.m.preset='skin-dark'"),
        of(Media, "material.metre", "material.m.metre=1500")
            .with(&["material.m={preset='milk', metre=900}"])
            .but(VOLUME, Nothing("`transfer` states it")),
        of(All, "material.tint", "material.m.tint=[0.9, 0.5, 0.2]"),
        of(Media, "material.medium.half_length", "material.m.medium={half_length=[0.5, 0.7, 1]}"),
        of(OPEN, "material.bump", "material.m.bump={height=0.1, size=0.5}").but_by(BUT_SURFELS, SMOOTH),
        of(OPEN, "material.bump.height", "material.m.bump.height=0.2").by(SURFELS).with(BUMPY),
        of(OPEN, "material.bump.size", "material.m.bump.size=1").by(SURFELS).with(BUMPY),
        of(OPEN, "material.bump.image", "material.m.bump.image='bright.hdr'").by(SURFELS).with(BUMPY),
        of(OPEN, "material.bump.octaves", "material.m.bump.octaves=1").by(SURFELS).with(BUMPY),
        of(OPEN, "material.bump.seed", "material.m.bump.seed=9").by(SURFELS).with(BUMPY),
    ]
}

const BUT_SURFELS: &[&str] = &["points", "particles", "sheets"];
const UNBENT: Expected = Nothing("this technique draws surfaces without the matter that they bound, and warns");
const SMOOTH: Expected = Nothing("this technique draws surfaces without bumps, and warns");
const BUMPY: &[&str] = &["material.m.bump={height=0.1, size=0.5}"];
const CAUCHY: &[&str] = &["material.m.cauchy={a=1.3, b=0.1}"];

const BALL: Which = These(&["medium_ball"]);
const POINTS_ONLY: Expected = Nothing("a setting of the technique `points`");
const COMMAND_ONLY: Expected = Nothing("a picture keeps to it by the command `organza render`, which budgets.rs tries");
const PARTICLES_ONLY: Expected = Nothing("a setting of the technique `particles`");
const NO_VOXELS: Expected = Nothing("a surface comes as splats, which have footprints of their own");
const BALL_AND_SURFACE: Which = These(&["medium_ball", "implicit"]);

fn render() -> Vec<Entry> {
    vec![
        one("render", "render={antialias=1}").by(POINTS),
        one("render.technique", "render.technique='particles'").by(POINTS),
        one("render.depth_ranges", "render.depth_ranges=3").with(THROUGH_THE_WALL),
        one("render.antialias", "render.antialias=1"),
        of(BALL, "render.tolerance", "render.tolerance=1").look(Look::Work).with(THIN),
        one("render.exposure", "render.exposure=1").look(Look::Displayed),
        one("render.layers", "render.layers=['depth']").look(Look::Layers),
        one("render.effects", "render.effects={'shadow.0'='off'}").with(SUN),
        one("render.seed", "render.seed=5").but_by(BUT_PARTICLES, Nothing("nothing of it is random")),
        of(BALL, "render.splat_share", "render.splat_share=0.5").by(POINTS),
        of(All, "render.max_points", "render.max_points=3").but(All, Refused(5, "max_points")),
        one("render.budget_ms", "render.budget_ms=1").but(All, COMMAND_ONLY),
        one("render.max_rmse", "render.max_rmse=0.5").but(All, COMMAND_ONLY),
        one("render.max_flip", "render.max_flip=0.5").but(All, COMMAND_ONLY),
        of(BALL, "render.points", "render.points={first_slices=1}").but_by(BUT_POINTS, POINTS_ONLY),
        of(BALL, "render.points.slice_thickness", "render.points.slice_thickness=0.5")
            .by(POINTS)
            .with(&["render.points.exact=false", "material.m.medium.extinction=0.8"]),
        of(BALL, "render.points.exact", "render.points.exact=false")
            .by(POINTS)
            .with(&["render.points.slice_thickness=0.5", "material.m.medium.extinction=0.8"]),
        of(BALL, "render.points.direction", "render.points.direction='back_to_front'")
            .look(Look::Work)
            .by(POINTS)
            .with(&[
                "object.it.medium_ball.spacing=0.04",
                "object.it.transform.scale=4",
                "render.points.transmittance_cutoff=0.5",
            ]),
        of(BALL, "render.points.first_slices", "render.points.first_slices=1").by(POINTS),
        of(BALL, "render.points.transmittance_cutoff", "render.points.transmittance_cutoff=0.9")
            .by(POINTS)
            .with(&["object.it.medium_ball.spacing=0.04", "object.it.transform.scale=4"]),
        of(BALL, "render.points.resampling_filter", "render.points.resampling_filter=false").by(POINTS),
        of(BALL, "render.points.accumulation", "render.points.accumulation='f16'").by(POINTS),
        of(BALL, "render.shadow", "render.shadow={cells=2}"),
        of(BALL, "render.shadow.mapping", "render.shadow.mapping='polar'"),
        of(BALL, "render.shadow.cells", "render.shadow.cells=4"),
        of(BALL, "render.shadow.absorbance_cut", "render.shadow.absorbance_cut=0.1"),
        one("render.particles", "render.particles={repeat_level=7}").but_by(BUT_PARTICLES, PARTICLES_ONLY),
        one("render.particles.repeat_level", "render.particles.repeat_level=7").by(PARTICLES).look(Look::Sets),
        one("render.particles.target_error", "render.particles.target_error=100")
            .by(PARTICLES)
            .look(Look::Sets)
            .with(&["render.particles.repeat_level=50"]),
        of(OPEN, "render.particles.surface_sampler", "render.particles.surface_sampler='triangles'").by(PARTICLES),
        of(Media, "render.particles.volume_sampler", "render.particles.volume_sampler='metropolis'").by(PARTICLES),
        one("render.particles.volume_sampler", "render.particles.volume_sampler='metropolis'")
            .but(All, Refused(2, "draws no volume, density, cloud or homogeneous medium"))
            .by(PARTICLES),
        of(Media, "render.particles.metropolis_stride", "render.particles.metropolis_stride=3")
            .with(&["render.particles.volume_sampler='metropolis'"])
            .by(PARTICLES),
        one("render.particles.brownian_step", "render.particles.brownian_step=0.05")
            .by(PARTICLES)
            .with(&["render.particles.surface_sampler='brownian'"]),
        of(BALL, "render.sheets", "render.sheets={slab_width=0.4}").by(SHEETS),
        of(BALL, "render.sheets.slicing", "render.sheets.slicing='half_vector'").by(SHEETS),
        of(VOLUME, "render.sheets.classify", "render.sheets.classify='before'").by(SHEETS),
        of(VOLUME, "render.sheets.classify", "render.sheets.classify='preintegrated'").by(SHEETS),
        of(VOLUME, "render.sheets.aligned", "render.sheets.aligned='axis'").by(SHEETS).with(&["camera.orthographic=2"]),
        of(BALL, "render.sheets.light_pixels", "render.sheets.light_pixels=0.4").by(SHEETS).with(HALF_VECTOR),
        of(BALL, "render.sheets.most_light_pixels", "render.sheets.most_light_pixels=16").by(SHEETS).with(HALF_VECTOR),
        of(BALL, "render.sheets.soft_shadows", "render.sheets.soft_shadows='one_sweep'").by(SHEETS).with(SOFT),
        of(BALL, "render.sheets.scattering", "render.sheets.scattering='forward_and_back'")
            .by(SHEETS)
            .with(HALF_VECTOR),
        of(BALL, "render.sheets.scattering_cone", "render.sheets.scattering_cone=70").by(SHEETS).with(SCATTERING),
        of(BALL, "render.sheets.voxels_per_cell", "render.sheets.voxels_per_cell=256").by(SHEETS).with(SCATTERING),
        of(BALL_AND_SURFACE, "render.sheets.slab_width", "render.sheets.slab_width=0.4").by(SHEETS),
        of(BALL, "render.sheets.reconstruction", "render.sheets.reconstruction='gather'")
            .by(SHEETS)
            .with(&["render.sheets.reconstruction='splat'"]),
        of(BALL, "render.sheets.kernel", "render.sheets.kernel='linear'").by(SHEETS),
        of(BALL_AND_SURFACE, "render.sheets.kernel_extent", "render.sheets.kernel_extent=3")
            .by(SHEETS)
            .but(These(&["implicit"]), NO_VOXELS),
        of(BALL_AND_SURFACE, "render.sheets.kernel_sigma", "render.sheets.kernel_sigma=1")
            .by(SHEETS)
            .but(These(&["implicit"]), NO_VOXELS),
        of(BALL, "render.sheets.kernel_sections", "render.sheets.kernel_sections=1").by(SHEETS),
        of(VOLUME, "render.sheets.gradients", "render.sheets.gradients='volume'").by(SHEETS).with(PHONG),
        of(VOLUME, "render.sheets.gradients", "render.sheets.gradients='sheets'").by(SHEETS).with(PHONG),
        of(BALL_AND_SURFACE, "render.sheets.accumulation", "render.sheets.accumulation='f16'").by(SHEETS),
        of(BALL, "render.sheets.transmittance_cutoff", "render.sheets.transmittance_cutoff=0.9")
            .by(SHEETS)
            .with(&["object.it.transform.scale=4"]),
    ]
}

const HALF_VECTOR: &[&str] = &["render.sheets.slicing='half_vector'"];

const SOFT: &[&str] = &[
    "render.sheets.slicing='half_vector'",
    "light=[{kind='sphere', position=[2, 3, 2], radius=0.3, intensity=[20, 18, 16], samples=4}]",
];

const SCATTERING: &[&str] = &["render.sheets.slicing='half_vector'", "render.sheets.scattering='forward_and_back'"];

const THIN: &[&str] = &[
    "material.m.medium.extinction=0.01",
    "object.wall.casts_shadow=false",
    "object.blocker.visible=false",
    "render.tolerance=1e-9",
];

const THROUGH_THE_WALL: &[&str] = &[
    "object.wall.rectangle={center=[0, 0, 0], u=[1, 0, 1], v=[0, 1, 0], spacing=0.12}",
    "object.wall.opacity=0.5",
    "object.wall.technique='reference'",
];

const MOVING: &[&str] = &["animation={frames=3, track=[{set='object.it.transform.translate', \
     keys=[{frame=0, value=[0, 0, 0]}, {frame=1, value=[0.1, 0, 0]}, {frame=2, value=[0.4, 0.3, 0]}]}]}"];
const HALF: &[&str] = &["animation={frames=5, track=[{set='object.it.transform.translate', \
     keys=[{frame=0, value=[0, 0, 0]}, {frame=4, value=[0.4, 0.3, 0]}]}]}"];
const BENT: &[&str] = &["animation={frames=5, track=[{set='object.it.transform.translate', \
     keys=[{frame=0, value=[0, 0, 0]}, {frame=2, value=[0.3, 0, 0]}, {frame=4, value=[0, 0.2, 0]}]}]}"];

fn animation() -> Vec<Entry> {
    vec![
        one("animation", "animation={frames=1, track=[{set='camera.fov_y', keys=[{frame=0, value=50}]}]}").at(0),
        one("animation.frames", "animation.frames=9").at(1).with(MOVING).look(Look::Told),
        one("animation.track", "animation.track=[]").at(1).with(MOVING),
        one("animation.track.set", "animation.track.0.set='object.it.transform.rotate'").at(1).with(MOVING),
        one("animation.track.keys", "animation.track.0.keys=[{frame=0, value=[0.2, 0, 0]}]").at(1).with(MOVING),
        one("animation.track.keys.frame", "animation.track.0.keys.1.frame=3").at(1).with(HALF),
        one("animation.track.keys.value", "animation.track.0.keys.1.value=[0, 0.4, 0]").at(1).with(HALF),
        one("animation.track.interpolation", "animation.track.0.interpolation='smooth'").at(1).with(BENT),
    ]
}
