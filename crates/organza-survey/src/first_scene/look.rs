//! How an object looks whose data has not been seen before: its tables in a scene.

use super::point_colors::{mesh_colors, point_colors};
use super::quoted;
use crate::data_file::DataFile;
use crate::labels::{Labels, Reading};
use crate::matter::Matter;
use crate::number::{color, grouped, rounded, significant};
use crate::preset::{Look, Preset, Wish};
use crate::stands::extent;
use crate::transfer::Transfer;
use convert::ColorMap;
use organza::scene::Recipe;
use organza::{Error, SourceData, printable};
use read::stated_up_axis;
use splat_core::text::counted;
use splat_core::{DAabb, Grid, optics};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Why labels of some volumes are not drawn.
pub(super) const AS_IT_IS: &str = "a `mesh` of labels takes no `array` and no `nodata`";

/// Colours of surfaces that have none, in turns.
const CLAYS: [[f32; 3]; 5] =
    [[0.68, 0.64, 0.59], [0.42, 0.53, 0.64], [0.70, 0.52, 0.33], [0.47, 0.58, 0.44], [0.62, 0.45, 0.50]];

/// Voxels up to which a volume is drawn on its own lattice.
const MOST_VOXELS: f64 = 24e6;

/// Part of the size of a volume that opacities refer to.
const UNIT: f64 = 0.02;

/// Least extinction over the largest that is written.
const DIGITS: f64 = 1e-4;

/// One object of a first scene.
pub(super) struct Object {
    /// What is said of its data.
    about: String,
    name: String,
    /// `mesh`, `points` or `volume`, and the path.
    source: (&'static str, String),
    /// Its material.
    material: Option<Material>,
    /// Further keys.
    keys: String,
    /// How many labels it has, if it is a volume of such.
    labels: Option<usize>,
    /// Why a volume that could have labels is drawn as amounts, a sentence.
    doubt: Option<String>,
}

impl Object {
    /// Its table.
    pub(super) fn text(&self) -> String {
        let Self { about, name, source: (key, path), keys, .. } = self;
        let named = |material: &Material| format!("material = \"{}\"\n", material.name);
        let material = self.material.as_ref().map_or_else(String::new, named);
        format!("\n[[object]]\nname = {}\n# {about}\n{key} = {}\n{material}{keys}", quoted(name), quoted(path))
    }

    /// How many labels it has, if it is a volume of such.
    pub(super) fn labels(&self) -> Option<usize> {
        self.labels
    }

    /// Why a volume that could have labels is drawn as amounts, a sentence.
    pub(super) fn doubt(&self) -> Option<&str> {
        self.doubt.as_deref()
    }

    /// The table of its material, where it is the first that has it.
    pub(super) fn material(&self) -> String {
        match &self.material {
            Some(Material { name, keys, is_first: true }) => format!("\n[material.{name}]\n{keys}"),
            _ => String::new(),
        }
    }
}

/// A material of a first scene.
#[derive(Clone)]
struct Material {
    name: &'static str,
    keys: Cow<'static, str>,
    /// Whether no object before has it: the table stands before its first object.
    is_first: bool,
}

impl Material {
    const fn new(name: &'static str, keys: &'static str) -> Self {
        Self { name, keys: Cow::Borrowed(keys), is_first: false }
    }

    /// A material with a name, for data of this size.
    fn of_recipe(recipe: &Recipe, is_medium: bool, size: f64) -> Self {
        let mut keys = format!(
            "preset = \"{}\"     # docs/materials.md of Organza; keys beside it take the place of its own\n",
            recipe.name
        );
        if recipe.has_lengths(is_medium) {
            let metre = significant(size / recipe.across_m, 3);
            let across = recipe.across_m;
            let _ =
                writeln!(keys, "metre = {metre}     # world units of a metre, as if the data were {across} m across");
        }
        Self { name: recipe.name, keys: keys.into(), is_first: false }
    }
}

const CLAY: Material = Material::new("clay", "specular = 0.015\nshininess = 20\n");
const TISSUE: Material = Material::new("tissue", "shading = \"phong\"\nspecular = 0.08\nshininess = 24\n");
const VALUES: Material = Material::new("values", "shading = \"unlit\"\n");
const DROPLETS: Material = Material::new("droplets", "ambient = 0.6\nmedium = { albedo = 0.98, asymmetry = 0.3 }\n");

/// The objects of all files, each with a name of its own.
pub(super) fn objects(data: &[DataFile], paths: &[String], table: Option<&str>, wish: &Wish) -> Vec<Object> {
    let mut names: BTreeMap<String, usize> = BTreeMap::new();
    let mut materials: Vec<&str> = Vec::new();
    let mut clays = CLAYS.iter().cycle();
    let all_stand = all_stand(data);
    let size = data.iter().filter_map(size_of).fold(0.0, f64::max);
    let mut named_object = |(file, path): (&DataFile, &String)| {
        let mut name = file.name();
        let count = names.entry(name.clone()).or_insert(0);
        *count += 1;
        if *count > 1 {
            name = format!("{name}-{count}");
        }
        let colors = match &file.data {
            // A material by name shows no column unless that is asked for too.
            SourceData::Points(_) if wish.material.is_some() && wish.color_by.is_none() => None,
            SourceData::Points(points) => point_colors(points, file.has_colors(), wish),
            SourceData::Mesh(_) | SourceData::Painted(..) => mesh_colors(file, wish),
            SourceData::Grid(_) | SourceData::Image(_) => None,
        };
        let is_bare = !file.is_colored() && colors.is_none() && wish.material.is_none();
        let bare = if is_bare { clays.next() } else { None };
        let has_map = colors.is_some();
        let mut object = object(file, wish, table, colors);
        if let Some(recipe) = wish.material {
            // Data without an extent is taken as one unit wide.
            object.take(recipe, file, has_map, if size > 0.0 { size } else { 1.0 });
        }
        if file.degrees {
            object.keys = format!("degrees = true     # x and y are longitude and latitude, z metres\n{}", object.keys);
        }
        if let Some(nodata) = file.nodata {
            let value = convert::written_value(nodata);
            object.keys = format!(
                "nodata = {value}     # far from all other values: voxels without one, which draw nothing\n{}",
                object.keys
            );
        }
        if let Some(array) = &file.array {
            object.keys = format!("array = {}\n{}", quoted(array), object.keys);
        }
        // The scene reads the axis from a file's name; data in memory has none, so the text states what its maker knows.
        let told = file.stated_up.filter(|_| stated_up_axis(&file.path).is_none());
        if let Some(up) = wish.up.or(told).or(file.stands.filter(|_| all_stand)) {
            object.keys = format!("transform = {{ up = \"{}\" }}\n{}", up.name(), object.keys);
        } else if file.stated_up.is_none() {
            object.keys = format!(
                "# Nothing in the file says which axis points up, so y does; `--up z` of init turns it.\n{}",
                object.keys
            );
        }
        if let (Some(clay), false) = (bare, matches!(file.data, SourceData::Grid(_))) {
            object.keys = format!("color = {}\n{}", color(*clay), object.keys);
        }
        if file.is_black() {
            object.keys =
                format!("# All colours of the file are black, as if it had none: others are shown.\n{}", object.keys);
        }
        if let Some(material) = &mut object.material {
            material.is_first = !materials.contains(&material.name);
            materials.push(material.name);
        }
        Object { name, source: (object.source.0, path.clone()), ..object }
    };
    data.iter().zip(paths).map(&mut named_object).collect()
}

/// Whether a preset changes how a file looks.
pub(super) fn takes_preset(file: &DataFile, wish: &Wish) -> bool {
    let is_map = wish.preset.as_ref().is_some_and(|preset| preset.map().is_some());
    match &file.data {
        SourceData::Grid(_) => true,
        SourceData::Points(points) => is_map && point_colors(points, file.has_colors(), wish).is_some(),
        SourceData::Mesh(_) | SourceData::Painted(..) if wish.preset.as_ref().is_some_and(Preset::is_labels) => {
            file.column.as_ref().is_some_and(|column| column.labels.is_some())
        }
        SourceData::Mesh(_) | SourceData::Painted(..) => is_map && mesh_colors(file, wish).is_some(),
        SourceData::Image(_) => false,
    }
}

/// Whether all files stand: those that belong together have one system of coordinates, in which all do, or none is stood up.
pub(super) fn all_stand(data: &[DataFile]) -> bool {
    data.iter().all(|file| file.stands.or(file.stated_up).is_some())
}

/// Whether a file is drawn as a medium: points are, where surfaces cannot have the material, and volumes are, unless labels make surfaces of them.
fn is_medium(file: &DataFile, has_labels: bool, recipe: &Recipe) -> bool {
    match &file.data {
        SourceData::Grid(_) => !has_labels,
        SourceData::Points(_) => !recipe.is_of_surfaces(),
        SourceData::Mesh(_) | SourceData::Painted(..) | SourceData::Image(_) => false,
    }
}

/// Refuses a material that a file cannot have.
pub(super) fn check_material(data: &[DataFile], objects: &[Object], wish: &Wish) -> Result<(), Error> {
    let Some(recipe) = wish.material else { return Ok(()) };
    for (file, object) in data.iter().zip(objects) {
        let is_medium = is_medium(file, object.labels.is_some(), recipe);
        let fits = |recipe: &&Recipe| if is_medium { recipe.is_of_media() } else { recipe.is_of_surfaces() };
        if fits(&recipe) {
            continue;
        }
        let [needed, is] = if is_medium { ["surfaces", "a volume"] } else { ["volumes and points", "a surface"] };
        let path = printable(&file.path);
        let message = format!("--material {}: {needed} alone may have it, and {path} is {is}", recipe.name);
        let names: Vec<&str> = Recipe::list().iter().filter(fits).map(|recipe| recipe.name).collect();
        return Err(Error::usage(message, format!("materials of {is} are {}", names.join(", "))));
    }
    Ok(())
}

/// What is said of volumes that have a material by name.
pub(super) fn material_remarks<'a>(data: &'a [DataFile], wish: &'a Wish) -> impl Iterator<Item = String> + 'a {
    let of_volume = |file: &&DataFile| matches!(file.data, SourceData::Grid(_));
    data.iter().filter(of_volume).filter(|_| wish.material.is_some()).map(|file| {
        let path = printable(&file.path);
        format!(
            "{path}: colours and extinction are those of its `transfer`; of --material it takes how light is scattered"
        )
    })
}

/// The diagonal of the box of a file's data.
fn size_of(file: &DataFile) -> Option<f64> {
    let bounds = match &file.data {
        SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => mesh.bounds(),
        SourceData::Points(points) => DAabb::of_points(points.position.iter().map(|p| points.origin + p.as_dvec3())),
        SourceData::Grid(grid) => extent(grid),
        SourceData::Image(_) => return None,
    };
    Some(bounds.diagonal()).filter(|size| *size > 0.0)
}

impl Object {
    /// Takes a material with a name, in the form in which its file has it; `size` is that of all data.
    fn take(&mut self, recipe: &Recipe, file: &DataFile, has_map: bool, size: f64) {
        let is_medium = is_medium(file, self.labels.is_some(), recipe);
        self.material = Some(Material::of_recipe(recipe, is_medium, size));
        if matches!(file.data, SourceData::Grid(_)) {
            return;
        }
        if !has_map {
            self.keys.clear();
        }
        if let (Some(rgb), true) = (recipe.color(), file.is_colored() && !has_map) {
            let rgb = color(rgb.map(|channel| channel as f32));
            let _ = writeln!(self.keys, "color = {rgb}     # that of the material: without it the file's count");
        }
        if is_medium {
            self.keys += "as = \"medium\"\n";
        }
    }
}

/// The object of a file; `table` is the path of the table of labels, as it is written.
fn object(file: &DataFile, wish: &Wish, table: Option<&str>, colors: Option<String>) -> Object {
    let preset = wish.preset.as_ref();
    let clay = Some(CLAY);
    let bare = |key, about, material, keys| Object {
        about,
        name: String::new(),
        source: (key, String::new()),
        material,
        keys,
        labels: None,
        doubt: None,
    };
    match &file.data {
        SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => {
            let about = format!(
                "{} triangles between {} vertices; {}",
                grouped(mesh.triangles.len() as u64),
                grouped(mesh.position.len() as u64),
                sides(mesh.bounds())
            );
            let labels = file.column.as_ref().and_then(|column| column.labels);
            let are_labels = preset.is_some_and(Preset::is_labels);
            let doubt = labels.filter(|_| !are_labels && colors.is_some()).map(|labels| {
                let numbers = counted(labels as u64, "whole number");
                format!("its {numbers} are taken for amounts, not for labels; --preset labels gives each a colour of its own")
            });
            let labels = labels.filter(|_| are_labels);
            Object { labels, doubt, ..bare("mesh", about, clay, colors.unwrap_or_default()) }
        }
        SourceData::Points(points) => {
            let positions = points.position.iter().map(|p| points.origin + p.as_dvec3());
            let what = match (points.gaussians.is_empty(), points.ready.cloud.is_empty()) {
                (false, _) => "3D Gaussians",
                (true, false) => "splats",
                (true, true) => "points",
            };
            let about = format!("{} {what}; {}", grouped(points.len() as u64), sides(DAabb::of_points(positions)));
            let as_they_are = "# Colours of a photograph hold its light: they are shown as they are; name a material to light them.\n";
            match colors {
                Some(colors) => bare("points", about, clay, colors),
                None if !file.has_colors() => bare("points", about, clay, String::new()),
                None => bare("points", about, None, as_they_are.to_owned()),
            }
        }
        SourceData::Grid(grid) => {
            let matter = Matter::in_surroundings(grid, file.value_outside);
            let is_as_it_is = file.array.is_none() && file.nodata.is_none();
            let reading = reading(grid, matter.as_ref(), wish);
            let doubt = match &reading {
                Reading::Labels(known) if !is_as_it_is => {
                    let count = counted(known.regions().count() as u64, "label");
                    Some(format!("its whole numbers look like {count}, but are taken for amounts: {AS_IT_IS}"))
                }
                Reading::Doubtful(said) => {
                    Some(Labels::doubt(said, grid, "--preset labels draws the surface of each label"))
                }
                Reading::Labels(_) | Reading::Amounts => None,
            };
            if let (Reading::Labels(known), true) = (&reading, is_as_it_is) {
                let labels = known.regions().count();
                let map = preset.and_then(Preset::map).map_or("distinct", |map| map.name());
                let colors = match table {
                    Some(path) => format!("labels = {}", quoted(path)),
                    None => format!("color_by = {{ column = \"label\", map = \"{map}\" }}"),
                };
                let keys = format!(
                    "# Whole numbers that name regions: the surface of each, in its own colour; 0 is nothing. `volume` in the place of `mesh` takes them for amounts.\n\
                     {colors}\n"
                );
                let about = format!(
                    "{} × {} × {} voxels of {labels} labels; {}",
                    grid.dims[0],
                    grid.dims[1],
                    grid.dims[2],
                    sides(extent(grid))
                );
                return Object { labels: Some(labels), ..bare("mesh", about, clay, keys) };
            }
            let look = volume_look(grid, matter.as_ref(), preset, file.stated_up.is_some());
            let material = match look {
                Some(Look::Cloud) => DROPLETS,
                Some(Look::Field(_)) => VALUES,
                _ => TISSUE,
            };
            let about =
                format!("{} × {} × {} voxels; {}", grid.dims[0], grid.dims[1], grid.dims[2], sides(extent(grid)));
            let keys = volume_keys(grid, matter.as_ref(), look.as_ref());
            Object { doubt, ..bare("volume", about, Some(material), keys) }
        }
        // Images are refused when they are read.
        SourceData::Image(_) => bare("environment", String::new(), None, String::new()),
    }
}

/// Whether a volume has labels: by the table or the look that is named, else by its numbers.
fn reading(grid: &Grid, matter: Option<&Matter>, wish: &Wish) -> Reading {
    if let Some(Ok(labels)) = stated_labels(grid, wish) {
        return Reading::Labels(labels);
    }
    let preset = wish.preset.as_ref();
    let is_of_amounts = preset.is_some_and(|preset| preset.map().is_none());
    if is_of_amounts {
        return Reading::Amounts;
    }
    match Labels::from_grid(grid) {
        Reading::Labels(_) if matter.is_some_and(Matter::has_units) => {
            let reason = "they have the range of Hounsfield units";
            Reading::Doubtful(format!("its whole numbers are taken for amounts, not for labels: {reason}"))
        }
        reading => reading,
    }
}

/// The labels of a volume by the table or the look that is named, or the reason why it has none; `None` where neither is.
pub(super) fn stated_labels(grid: &Grid, wish: &Wish) -> Option<Result<Labels, String>> {
    match &wish.labels {
        _ if wish.preset.as_ref().is_some_and(Preset::is_labels) => Some(Labels::whole(grid)),
        Some(labels) => Some(Labels::by_table(grid, &labels.table)),
        None => None,
    }
}

/// How a volume looks: a computed field in the colours of a map, a computed tomogram that has bones as bones in a film, unless its look has a name. What scanners measure comes in whole numbers, in
/// Hounsfield units, or in formats that state how the patient lies.
fn volume_look(grid: &Grid, matter: Option<&Matter>, preset: Option<&Preset>, is_scan: bool) -> Option<Look> {
    let has_units = matter.is_some_and(Matter::has_units);
    let is_field = || !is_scan && !has_units && grid.values.iter().any(|value| value.fract() != 0.0);
    let look = preset.map(|preset| &preset.0);
    match look {
        None if has_units && matter.is_some_and(Matter::has_bones) => Some(Look::Tomogram),
        None if is_field() => {
            let has_both_signs = matter.is_some_and(|matter| matter.opposite.is_some());
            Some(Look::Field(if has_both_signs { ColorMap::COOLWARM } else { ColorMap::VIRIDIS }))
        }
        Some(Look::Map(map)) if is_field() => Some(Look::Field(*map)),
        look => look.cloned(),
    }
}

/// The lengths of a box's sides.
fn sides(bounds: DAabb) -> String {
    let size = bounds.size().to_array();
    let largest = size.iter().copied().fold(0.0, f64::max);
    format!("{} world units", size.map(|s| rounded(s, 1e-3 * largest.max(1e-300))).join(" × "))
}

/// The least step of the lattice that a volume is drawn on, world units, and the largest one.
pub(super) fn drawn_steps(grid: &Grid) -> [f64; 2] {
    let steps = [grid.axes.x_axis, grid.axes.y_axis, grid.axes.z_axis].map(|axis| axis.length());
    let grid_steps = || [steps.into_iter().fold(f64::INFINITY, f64::min), steps.into_iter().fold(0.0, f64::max)];
    coarser_spacing(grid).map_or_else(grid_steps, |spacing| [spacing; 2])
}

/// The spacing that a large volume is drawn with instead of its own.
fn coarser_spacing(grid: &Grid) -> Option<f64> {
    let voxels: f64 = grid.dims.iter().map(|n| *n as f64).product();
    (voxels > MOST_VOXELS).then(|| (grid.cell_volume() * voxels / MOST_VOXELS).cbrt())
}

/// `unit_length` and `transfer`, and a coarser lattice for a large volume.
fn volume_keys(grid: &Grid, matter: Option<&Matter>, look: Option<&Look>) -> String {
    let transfer = Transfer::new(grid, matter, look);
    let unit = significant(UNIT * extent(grid).diagonal(), 2);
    let unit_length: f64 = unit.parse().unwrap_or(UNIT * extent(grid).diagonal());
    let mut text = String::new();
    if let Some(spacing) = coarser_spacing(grid) {
        let _ = writeln!(
            text,
            "spacing = {}     # coarser than the file, for speed; leave it out for all voxels",
            significant(spacing, 3)
        );
    }
    if matter.is_some_and(|m| m.opposite.is_some()) {
        text += "# Values of both signs: those near 0 do not show.\n";
    }
    if let Some(air) = matter.and_then(|m| m.air) {
        let _ = writeln!(text, "# Around it the values are about {}.", significant(air, 3));
    }
    let _ = writeln!(
        text,
        "unit_length = {unit}     # opacities below are over this length: a smaller one makes all denser\ntransfer = ["
    );
    // A volume of one value states that as it is.
    let alone = || 1e-6 * transfer.points[0].value.abs();
    let step = matter.map_or_else(alone, |m| 1e-4 * (m.last - m.first).abs());
    for point in &transfer.points {
        // With three digits nothing may become 1, which no medium has.
        let opacity = optics::opacity(transfer.extinction * point.weight * unit_length).min(0.999);
        let opacity = if point.weight < DIGITS { "0".to_owned() } else { significant(opacity, 3) };
        let value = rounded(point.value, step.max(1e-300));
        let _ = writeln!(text, "  {{ value = {value}, color = {}, opacity = {opacity} }},", color(point.color));
    }
    text + "]\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3};

    /// A ball whose values fade.
    fn ball(value: impl Fn(f64) -> f64) -> Grid {
        let at = |i: usize| DVec3::new((i % 12) as f64, (i / 12 % 12) as f64, (i / 144) as f64) - 5.5;
        let values = (0..1728).map(|i| value(at(i).length_squared()) as f32).collect();
        Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [12; 3], values }
    }

    #[test]
    fn computed_fields_have_the_colours_of_values_and_scans_those_of_tissue() {
        let field = ball(|r| libm::exp(-r / 12.0));
        let [bytes, units] = [ball(|r| (255.0 * libm::exp(-r / 12.0)).floor()), ball(|r| 900.0 - 60.1 * r)];
        let look = |grid: &Grid, name: Option<&str>, is_scan| {
            let preset = name.map(|name| Preset::named(name).expect("a look"));
            volume_look(grid, Matter::from_grid(grid).as_ref(), preset.as_ref(), is_scan)
        };
        assert_eq!(look(&field, None, false), Some(Look::Field(ColorMap::VIRIDIS)));
        assert!(matches!(look(&field, Some("turbo"), false), Some(Look::Field(_))));
        assert_eq!(look(&field, Some("cloud"), false), Some(Look::Cloud));
        assert_eq!(look(&field, None, true), None);
        assert_eq!(look(&bytes, None, false), None);
        assert!(matches!(look(&bytes, Some("turbo"), false), Some(Look::Map(_))));
        assert_eq!(look(&units, None, false), Some(Look::Tomogram));
        // A brain without its skull has no bones: they would be nothing in a dark film.
        let brain = ball(|r| if r < 20.0 { 22.0 + (r * 7919.0) % 64.0 } else { -1024.0 });
        let with_a_clot =
            Grid { values: brain.values.iter().map(|v| if *v > 73.0 { 172.0 } else { *v }).collect(), ..brain };
        let matter = Matter::from_grid(&with_a_clot).expect("matter");
        assert!(matter.has_units() && !matter.has_bones(), "{matter:?}");
        assert_eq!(look(&with_a_clot, None, true), None);
        assert_eq!(look(&with_a_clot, Some("ct-bone"), true), Some(Look::CtBone));
        let both = ball(|r| libm::exp(-r / 12.0) - libm::exp(-(r - 20.0).abs() / 12.0));
        assert_eq!(look(&both, None, false), Some(Look::Field(ColorMap::COOLWARM)));
        // Two lobes with the range of a tomogram.
        let sign = |i: usize| if i < 864 { 1500.0 } else { -1500.0 };
        let values = field.values.iter().enumerate().map(|(i, value)| sign(i) * value).collect();
        let lobes = Grid { values, ..field };
        assert!(Matter::from_grid(&lobes).is_some_and(|matter| !matter.has_units() && matter.opposite.is_some()));
        assert!(matches!(look(&lobes, None, false), Some(Look::Field(_))));
    }

    #[test]
    fn slabs_follow_the_lattice_that_is_drawn() {
        let axes = DMat3::from_diagonal(DVec3::new(0.5, 0.5, 2.5));
        let scan = |dims: [usize; 3]| Grid { origin: DVec3::ZERO, axes, dims, values: Vec::new() };
        assert_eq!(drawn_steps(&scan([100; 3])), [0.5, 2.5]);
        let [least, most] = drawn_steps(&scan([400; 3]));
        assert!(least == most && (least - (0.625 * 64e6 / MOST_VOXELS).cbrt()).abs() < 1e-9, "{least}");
    }
}
