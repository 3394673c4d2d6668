//! Data from arrays: a mesh, points, a volume or an image, checked once and read where it lies.

use crate::arrays;
use crate::errors::{raised, refused};

use numpy::{PyArray1, PyArrayMethods};
use organza::{Error, SourceData};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use read::{Loaded, Painting, PaintingParts, ReadParams, Rgba, TextureImage, TexturePlaces, Textures};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Association, Column, Grid, Mesh, MeshColumn, RadianceImage, RawPoints, Relative};
use std::path::{Path, PathBuf};

/// A mesh, points, a volume or an image in memory, which scenes name as `memory:NAME`.
#[pyclass(frozen, module = "organza._organza")]
pub(crate) struct Data {
    pub(crate) data: SourceData,
    /// Changes of the arrays that their owner should know, one sentence each.
    notes: Vec<String>,
}

impl From<SourceData> for Data {
    fn from(data: SourceData) -> Self {
        Self { data, notes: Vec::new() }
    }
}

/// The texture of a mesh as [`Data::arrays`] has it; the argument `painting` of [`Data::mesh`].
#[derive(FromPyObject)]
pub(crate) struct Painted<'py> {
    /// (n, 2): (0, 0) is the upper left corner of the image.
    #[pyo3(item)]
    places: Bound<'py, PyAny>,
    /// (n, 4), linear colours and opacities that the texture is multiplied by.
    #[pyo3(item)]
    tint: Option<Bound<'py, PyAny>>,
    /// (height, width, 4), bytes of sRGB or linear numbers.
    #[pyo3(item)]
    texels: Bound<'py, PyAny>,
    #[pyo3(item)]
    stated_triangles: u64,
}

/// The image that a mesh is painted with: a PNG or JPEG file, or pixels.
#[derive(FromPyObject)]
pub(crate) enum Texture<'py> {
    #[pyo3(transparent)]
    File(PathBuf),
    #[pyo3(transparent)]
    Pixels(Bound<'py, PyAny>),
}

#[pymethods]
impl Data {
    /// A mesh: vertices (n, 3), faces (m, 3) of indices, and by vertex normals, linear colours or bytes of sRGB, and opacities; columns by name, of
    /// vertices (n,) and of faces (m,); places `uv` of a texture, (n, 2) or (m, 3, 2), with the texture. `unit_normals` and `painting` are those of [`Self::arrays`].
    #[staticmethod]
    #[pyo3(signature = (
        vertices, faces, normals=None, colors=None, opacities=None, columns=None, face_columns=None, uv=None, texture=None,
        unit_normals=None, painting=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of the call from Python")]
    fn mesh(
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        colors: Option<&Bound<'_, PyAny>>,
        opacities: Option<&Bound<'_, PyAny>>,
        columns: Option<&Bound<'_, PyDict>>,
        face_columns: Option<&Bound<'_, PyDict>>,
        uv: Option<&Bound<'_, PyAny>>,
        texture: Option<Texture<'_>>,
        unit_normals: Option<&Bound<'_, PyAny>>,
        painting: Option<Painted<'_>>,
    ) -> PyResult<Self> {
        let positions = arrays::positions("vertices", vertices)?;
        let count = positions.len();
        let Relative { origin, offsets } = relative("vertices", &positions)?;
        let triangles = arrays::triangles("faces", faces, count)?;
        let mut named = mesh_columns(columns, Association::Vertex, count)?;
        named.extend(mesh_columns(face_columns, Association::Triangle, triangles.len())?);
        let mesh = Mesh {
            origin,
            position: offsets,
            normal: unit_vectors(normals, unit_normals, count)?,
            color: colors.map_or_else(|| Ok(Vec::new()), |colors| arrays::colors("colors", colors, count))?,
            opacity: numbers("opacities", opacities, count)?,
            columns: named,
            triangles,
        };
        if let Some(painting) = painting {
            let painting = painting_again(&painting, count)?;
            return Ok(SourceData::Painted(mesh.into(), painting.into()).into());
        }
        match (uv, texture) {
            (None, None) => {
                let smooth = read::smoothed_in_memory("vertices", mesh, &ReadParams::default());
                let smooth = smooth.map_err(|error| raised(&Error::from_read(Path::new(&error.file), &error)))?;
                Ok(SourceData::Mesh(smooth.into()).into())
            }
            (Some(uv), Some(texture)) => textured(mesh, uv, &texture),
            (Some(_), None) => Err(refused("texture", "an image beside `uv`", "none")),
            (None, Some(_)) => Err(refused("uv", "texture coordinates beside `texture`", "none")),
        }
    }

    /// Points: positions (n, 3), and by point normals, linear colours or bytes of sRGB, opacities, values, and named columns of numbers.
    #[staticmethod]
    #[pyo3(signature = (
        positions, normals=None, colors=None, opacities=None, values=None, columns=None, unit_normals=None
    ))]
    fn points(
        positions: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        colors: Option<&Bound<'_, PyAny>>,
        opacities: Option<&Bound<'_, PyAny>>,
        values: Option<&Bound<'_, PyAny>>,
        columns: Option<&Bound<'_, PyDict>>,
        unit_normals: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let places = arrays::positions("positions", positions)?;
        let count = places.len();
        let Relative { origin, offsets } = relative("positions", &places)?;
        let mut named = Vec::new();
        for (name, array) in columns.into_iter().flatten() {
            let name: String = name.extract()?;
            let shown = column_name(&name);
            arrays::check_rows(&shown, &array, Some(count), 1)?;
            let values = arrays::column(&shown, &array, |value| value)?;
            named.push(Column { name, values });
        }
        let points = RawPoints {
            origin,
            position: offsets,
            normal: unit_vectors(normals, unit_normals, count)?,
            color: colors.map_or_else(|| Ok(Vec::new()), |colors| arrays::colors("colors", colors, count))?,
            opacity: numbers("opacities", opacities, count)?,
            value: numbers("values", values, count)?,
            columns: named,
            ..RawPoints::default()
        };
        Ok(SourceData::Points(points.into()).into())
    }

    /// A volume: values (nz, ny, nx), the steps along x, y and z, the place of the first value, and the directions of the steps, the columns of a 3 x 3
    /// matrix.
    #[staticmethod]
    fn grid(
        values: &Bound<'_, PyAny>,
        spacing: [f64; 3],
        origin: [f64; 3],
        direction: [[f64; 3]; 3],
    ) -> PyResult<Self> {
        let sides = arrays::shape("values", values)?;
        let &[depth, height, width] = sides.as_slice() else {
            return Err(refused("values", "the shape (nz, ny, nx)", &arrays::shape_text(&sides)));
        };
        // Rows of the matrix as numpy has them.
        let directions = DMat3::from_cols_array_2d(&direction).transpose();
        let axes = DMat3::from_cols(
            directions.x_axis * spacing[0],
            directions.y_axis * spacing[1],
            directions.z_axis * spacing[2],
        );
        let values = arrays::column("values", values, |value| value as f32)?;
        let grid = Grid { origin: DVec3::from_array(origin), axes, dims: [width, height, depth], values };
        Ok(SourceData::Grid(grid.into()).into())
    }

    /// An image of radiance: pixels (height, width, 3), linear, from the top left.
    #[staticmethod]
    fn image(pixels: &Bound<'_, PyAny>) -> PyResult<Self> {
        let sides = arrays::shape("pixels", pixels)?;
        let &[height, width, 3] = sides.as_slice() else {
            return Err(refused("pixels", "the shape (height, width, 3)", &arrays::shape_text(&sides)));
        };
        let side = |side: usize| u32::try_from(side).map_err(|_| refused("pixels", "fewer pixels a side", "too many"));
        let size = [side(width)?, side(height)?];
        let numbers = arrays::column("pixels", pixels, |value| value as f32)?;
        let image = RadianceImage { size, pixels: numbers.as_chunks().0.to_vec() };
        Ok(SourceData::Image(image.into()).into())
    }

    /// `mesh`, `points`, `grid` or `image`.
    #[getter]
    fn kind(&self) -> &'static str {
        match self.data {
            SourceData::Mesh(_) | SourceData::Painted(..) => "mesh",
            SourceData::Points(_) => "points",
            SourceData::Grid(_) => "grid",
            SourceData::Image(_) => "image",
        }
    }

    /// Bytes that it holds.
    #[getter]
    fn nbytes(&self) -> u64 {
        self.data.bytes()
    }

    /// Changes of the arrays, one sentence without a name each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Its arrays by the names of the arguments that make it again, with the same bits.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let parts = PyDict::new(py);
        match &self.data {
            SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => {
                parts.set_item("vertices", table(py, placed(mesh.origin, &mesh.position))?)?;
                let faces: Vec<u32> = mesh.triangles.as_flattened().to_vec();
                let count = mesh.triangles.len();
                parts.set_item("faces", PyArray1::from_vec(py, faces).reshape([count, 3])?)?;
                add_vectors(&parts, "unit_normals", &mesh.normal)?;
                add_colors(&parts, &mesh.color)?;
                if !mesh.opacity.is_empty() {
                    parts.set_item("opacities", PyArray1::from_slice(py, &mesh.opacity))?;
                }
                let kinds = [("columns", Association::Vertex), ("face_columns", Association::Triangle)];
                for (name, association) in kinds {
                    let columns = PyDict::new(py);
                    for column in mesh.columns.iter().filter(|column| column.association == association) {
                        columns.set_item(&column.name, PyArray1::from_slice(py, &column.values))?;
                    }
                    parts.set_item(name, columns)?;
                }
                if let SourceData::Painted(_, painting) = &self.data {
                    parts.set_item("painting", painting_table(py, painting)?)?;
                }
            }
            SourceData::Points(points) => {
                parts.set_item("positions", table(py, placed(points.origin, &points.position))?)?;
                add_vectors(&parts, "unit_normals", &points.normal)?;
                add_colors(&parts, &points.color)?;
                for (name, numbers) in [("opacities", &points.opacity), ("values", &points.value)] {
                    if !numbers.is_empty() {
                        parts.set_item(name, PyArray1::from_slice(py, numbers))?;
                    }
                }
                let columns = PyDict::new(py);
                for column in &points.columns {
                    columns.set_item(&column.name, PyArray1::from_slice(py, &column.values))?;
                }
                parts.set_item("columns", columns)?;
            }
            SourceData::Grid(grid) => {
                let [width, height, depth] = grid.dims;
                let values = PyArray1::from_slice(py, &grid.values).reshape([depth, height, width])?;
                parts.set_item("values", values)?;
                parts.set_item("spacing", [1.0; 3])?;
                parts.set_item("origin", grid.origin.to_array())?;
                parts.set_item("direction", grid.axes.transpose().to_cols_array_2d())?;
            }
            SourceData::Image(image) => {
                let [width, height] = image.size.map(|side| side as usize);
                let pixels = PyArray1::from_slice(py, image.pixels.as_flattened()).reshape([height, width, 3])?;
                parts.set_item("pixels", pixels)?;
            }
        }
        Ok(parts)
    }
}

/// The parts of a painting as arrays, for [`painting_again`].
fn painting_table<'py>(py: Python<'py>, painting: &Painting) -> PyResult<Bound<'py, PyDict>> {
    let no_parts = || raised(&Error::Internal("a painting of several materials in memory".into()));
    let PaintingParts { places, tint, size, rgba, stated_triangles } =
        read::parts_of_painting(painting).ok_or_else(no_parts)?;
    let [width, height] = size.map(|side| side as usize);
    let sides = [height, width, 4];
    let table = PyDict::new(py);
    table.set_item("places", PyArray1::from_slice(py, places.as_flattened()).reshape([places.len(), 2])?)?;
    let tints = (!tint.is_empty()).then(|| PyArray1::from_slice(py, tint.as_flattened()).reshape([tint.len(), 4]));
    table.set_item("tint", tints.transpose()?)?;
    match rgba {
        Rgba::Srgb(texels) => {
            table.set_item("texels", PyArray1::from_slice(py, texels.as_flattened()).reshape(sides)?)?;
        }
        Rgba::Linear(texels) => {
            table.set_item("texels", PyArray1::from_slice(py, texels.as_flattened()).reshape(sides)?)?;
        }
    }
    table.set_item("stated_triangles", stated_triangles)?;
    Ok(table)
}

/// The painting of a mesh of `vertices` from the arrays that [`painting_table`] made.
fn painting_again(painted: &Painted<'_>, vertices: usize) -> PyResult<Painting> {
    const NAME: &str = "painting";
    arrays::check_rows("places", &painted.places, Some(vertices), 2)?;
    let places = arrays::column("places", &painted.places, |value| value as f32)?;
    let tint = match &painted.tint {
        Some(tint) => {
            arrays::check_rows("tint", tint, Some(vertices), 4)?;
            arrays::column("tint", tint, |value| value as f32)?
        }
        None => Vec::new(),
    };
    let TextureImage::Texels { size, rgba } = texels(NAME, &painted.texels)? else {
        return Err(refused(NAME, "texels", "the path of a file"));
    };
    let parts = PaintingParts {
        places: places.as_chunks().0.to_vec(),
        tint: tint.as_chunks().0.to_vec(),
        size,
        rgba,
        stated_triangles: painted.stated_triangles,
    };
    let made = read::painting_of_parts(NAME, parts, &ReadParams::default());
    made.map_err(|error| raised(&Error::from_read(Path::new(&error.file), &error)))
}

/// The mesh with the colours of a texture.
fn textured(mesh: Mesh, uv: &Bound<'_, PyAny>, texture: &Texture<'_>) -> PyResult<Data> {
    const NAME: &str = "texture";
    let vertices = mesh.position.len();
    let faces = mesh.triangles.len();
    let sides = arrays::shape("uv", uv)?;
    let numbers = arrays::column("uv", uv, |value| value as f32)?;
    let (places, _) = numbers.as_chunks::<2>();
    let places = match sides.as_slice() {
        [rows, 2] if *rows == vertices => TexturePlaces::Vertices(places.to_vec()),
        [rows, 3, 2] if *rows == faces => TexturePlaces::Corners(places.as_chunks().0.to_vec()),
        _ => {
            let expected = format!("the shape ({vertices}, 2) of vertices or ({faces}, 3, 2) of corners of triangles");
            return Err(refused("uv", &expected, &arrays::shape_text(&sides)));
        }
    };
    let image = match texture {
        Texture::File(path) => TextureImage::File(path.clone()),
        Texture::Pixels(pixels) => texels(NAME, pixels)?,
    };
    let params = ReadParams { textures: Textures::Kept, ..ReadParams::default() };
    let painted = read::textured_in_memory(NAME, mesh, &places, image, &params);
    let (loaded, notes) = painted.map_err(|error| raised(&Error::from_read(Path::new(&error.file), &error)))?;
    let data = match loaded {
        Loaded::Painted(mesh, painting) => SourceData::Painted(mesh.into(), painting.into()),
        Loaded::Mesh(mesh) => SourceData::Mesh(mesh.into()),
        _ => return Err(raised(&Error::Internal("a textured mesh that is none".into()))),
    };
    Ok(Data { data, notes: notes.remarks })
}

/// The texels of an image in memory: bytes of sRGB, or linear numbers; opaque without a fourth channel.
fn texels(name: &str, pixels: &Bound<'_, PyAny>) -> PyResult<TextureImage> {
    let sides = arrays::shape(name, pixels)?;
    let &[height, width, channels @ (3 | 4)] = sides.as_slice() else {
        let expected = "a path, or an image of the shape (height, width, 3) or (height, width, 4)";
        return Err(refused(name, expected, &arrays::shape_text(&sides)));
    };
    let side = |side: usize| u32::try_from(side).map_err(|_| refused(name, "fewer pixels a side", "too many"));
    let size = [side(width)?, side(height)?];
    let rgba = if arrays::is_bytes(pixels) {
        // A byte stays what it is.
        let bytes = arrays::column(name, pixels, |value| value as u8)?;
        Rgba::Srgb(bytes.chunks_exact(channels).map(|texel| with_opacity(texel, u8::MAX)).collect())
    } else if arrays::is_of_two_bytes(pixels) {
        let numbers = arrays::column(name, pixels, |value| (value / f64::from(u16::MAX)) as f32)?;
        let linear = |[red, green, blue, opacity]: [f32; 4]| {
            let decoded = |value| splat_core::srgb::decoded(f64::from(value)) as f32;
            [decoded(red), decoded(green), decoded(blue), opacity]
        };
        Rgba::Linear(numbers.chunks_exact(channels).map(|texel| linear(with_opacity(texel, 1.0))).collect())
    } else {
        let numbers = arrays::column(name, pixels, |value| value as f32)?;
        Rgba::Linear(numbers.chunks_exact(channels).map(|texel| with_opacity(texel, 1.0)).collect())
    };
    Ok(TextureImage::Texels { size, rgba })
}

/// The channels of a texel of three or four, with an opacity in any case.
fn with_opacity<T: Copy>(texel: &[T], opaque: T) -> [T; 4] {
    std::array::from_fn(|channel| texel.get(channel).copied().unwrap_or(opaque))
}

/// Named numbers of vertices or triangles.
fn mesh_columns(
    columns: Option<&Bound<'_, PyDict>>,
    association: Association,
    count: usize,
) -> PyResult<Vec<MeshColumn>> {
    let mut named = Vec::new();
    for (name, array) in columns.into_iter().flatten() {
        let name: String = name.extract()?;
        let shown = column_name(&name);
        arrays::check_rows(&shown, &array, Some(count), 1)?;
        let values = arrays::column(&shown, &array, |value| value)?;
        named.push(MeshColumn { name, association, values });
    }
    Ok(named)
}

/// A column in messages, by the argument that has it.
fn column_name(name: &str) -> String {
    format!("columns, '{name}'")
}

/// One number a row; none stays none.
fn numbers(name: &str, array: Option<&Bound<'_, PyAny>>, rows: usize) -> PyResult<Vec<f32>> {
    let Some(array) = array else { return Ok(Vec::new()) };
    arrays::check_rows(name, array, Some(rows), 1)?;
    arrays::column(name, array, |value| value as f32)
}

/// Positions as drawing has them.
fn relative(name: &str, positions: &[DVec3]) -> PyResult<Relative> {
    Relative::from_positions(positions, Vec::new()).map_err(|place| {
        let expected = "finite coordinates that fit 32-bit floats once the middle is subtracted";
        refused(name, expected, &format!("{} in row {place}", positions[place]))
    })
}

/// Normals made as long as one, or those that are so already, which keep their bits; none stays none.
fn unit_vectors(
    normals: Option<&Bound<'_, PyAny>>,
    unit_normals: Option<&Bound<'_, PyAny>>,
    rows: usize,
) -> PyResult<Vec<Vec3>> {
    const NAME: &str = "normals";
    let Some(array) = unit_normals.or(normals) else { return Ok(Vec::new()) };
    let vectors = arrays::vectors(NAME, array, rows)?;
    if let Some(row) = vectors.iter().position(|vector| !vector.is_finite()) {
        return Err(refused(NAME, "finite numbers", &format!("{} in row {row}", vectors[row])));
    }
    if unit_normals.is_some() {
        return Ok(vectors);
    }
    Ok(vectors.into_iter().map(Vec3::normalize_or_zero).collect())
}

/// Places of offsets.
fn placed(origin: DVec3, offsets: &[Vec3]) -> Vec<f64> {
    offsets.iter().flat_map(|offset| (origin + offset.as_dvec3()).to_array()).collect()
}

/// Rows of three numbers.
fn table(py: Python<'_>, numbers: Vec<f64>) -> PyResult<Bound<'_, numpy::PyArray2<f64>>> {
    let rows = numbers.len() / 3;
    PyArray1::from_vec(py, numbers).reshape([rows, 3])
}

fn add_vectors(parts: &Bound<'_, PyDict>, name: &str, vectors: &[Vec3]) -> PyResult<()> {
    if vectors.is_empty() {
        return Ok(());
    }
    let numbers: Vec<f32> = vectors.iter().flat_map(Vec3::to_array).collect();
    parts.set_item(name, PyArray1::from_vec(parts.py(), numbers).reshape([vectors.len(), 3])?)
}

fn add_colors(parts: &Bound<'_, PyDict>, colors: &[[f32; 3]]) -> PyResult<()> {
    if colors.is_empty() {
        return Ok(());
    }
    let numbers = colors.as_flattened().to_vec();
    parts.set_item("colors", PyArray1::from_vec(parts.py(), numbers).reshape([colors.len(), 3])?)
}
