//! The description of an E57 file, in XML: its scans, the fields of their points, and their poses.

use super::bits::Stored;
use super::damaged;
use super::pages::Pages;
use crate::error::ReadError;
use crate::text::xml;
use roxmltree::Node;
use splat_core::glam::{DQuat, DVec3};
use splat_core::text::escaped;

/// Most elements, attributes and texts; a scan has some dozens.
const MAX_NODES: u32 = 200_000;
/// Most fields of a point, and of all scans together; each name is held against all others.
pub(super) const MAX_FIELDS: usize = 256;
/// How far from 1 the length of a quaternion may be.
const SLACK: f64 = 1e-3;

/// What a file holds.
pub(super) struct Document {
    pub(super) scans: Vec<Scan>,
    /// Number of its pictures.
    pub(super) images: usize,
}

/// The points of a scan.
pub(super) struct Scan {
    /// How many there are.
    pub(super) points: u64,
    /// Byte of the file at which their section begins.
    pub(super) section: u64,
    pub(super) fields: Vec<Field>,
    pub(super) pose: Pose,
    /// Lowest and highest stored red, green and blue.
    pub(super) colors: Option<[[f64; 2]; 3]>,
    /// Where it is told of.
    pub(super) place: u64,
}

/// A field of a point.
pub(super) struct Field {
    pub(super) name: String,
    pub(super) stored: Stored,
    /// Lowest and highest number, where they are told.
    pub(super) range: Option<[f64; 2]>,
}

/// Where a scanner stood.
pub(super) struct Pose {
    pub(super) rotation: DQuat,
    pub(super) translation: DVec3,
}

/// Elements with the byte of the file at which they begin.
struct Reader<'p> {
    pages: &'p Pages,
}

impl Document {
    pub(super) fn parse(pages: &Pages) -> Result<Self, ReadError> {
        let reader = Reader { pages };
        let start = pages.byte(pages.description.start);
        let text = std::str::from_utf8(&pages.bytes()[pages.description.clone()]);
        let text = text.map_err(|_| damaged(start, "a description in UTF-8", "another byte"))?;
        // Some writers end it with zeros.
        let document = xml::parse(text.trim_end_matches('\0'), MAX_NODES).map_err(|e| {
            damaged(pages.byte(pages.description.start + e.byte), format!("{} as the description", e.expected), e.found)
        })?;
        let root = document.root_element();
        if root.tag_name().name() != "e57Root" {
            return Err(reader.wrong(root, "an element e57Root", root.tag_name().name()));
        }
        let entries = |name: &str| child(root, name).into_iter().flat_map(|vector| elements(vector));
        let scans = entries("data3D").map(|scan| reader.scan(scan)).collect::<Result<_, _>>()?;
        Ok(Self { scans, images: entries("images2D").count() })
    }
}

fn elements<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}

/// The child of a name, whatever its namespace.
fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    elements(node).find(|c| c.tag_name().name() == name)
}

impl Reader<'_> {
    fn byte(&self, node: Node<'_, '_>) -> u64 {
        self.pages.byte(self.pages.description.start + node.range().start)
    }

    fn wrong(&self, node: Node<'_, '_>, expected: &str, found: &str) -> ReadError {
        damaged(self.byte(node), expected, format!("'{}'", escaped(found.as_bytes(), 60)))
    }

    /// An attribute as a number, if it is there.
    fn attribute<T: std::str::FromStr>(&self, node: Node<'_, '_>, name: &str) -> Result<Option<T>, ReadError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let parsed = text.trim().parse().map(Some);
        parsed.map_err(|_| self.wrong(node, &format!("a number as {name}"), text))
    }

    /// The number in an element, 0 in an empty one.
    fn number(&self, node: Node<'_, '_>) -> Result<f64, ReadError> {
        let text = node.text().unwrap_or_default().trim();
        let number = if text.is_empty() { Some(0.0) } else { text.parse().ok().filter(|n: &f64| n.is_finite()) };
        let scaled = number.ok_or_else(|| self.wrong(node, "a finite number", text))?;
        if node.attribute("type") != Some("ScaledInteger") {
            return Ok(scaled);
        }
        let [scale, offset] =
            [self.attribute(node, "scale")?.unwrap_or(1.0), self.attribute(node, "offset")?.unwrap_or(0.0)];
        Ok(scaled * scale + offset)
    }

    /// Numbers of the children of these names, `default` where there is none.
    fn numbers<const N: usize>(
        &self,
        node: Node<'_, '_>,
        names: [&str; N],
        default: f64,
    ) -> Result<[f64; N], ReadError> {
        let mut numbers = [default; N];
        for (number, name) in numbers.iter_mut().zip(names) {
            if let Some(child) = child(node, name) {
                *number = self.number(child)?;
            }
        }
        Ok(numbers)
    }

    fn scan(&self, scan: Node<'_, '_>) -> Result<Scan, ReadError> {
        let points = child(scan, "points").ok_or_else(|| self.wrong(scan, "an element points of the scan", "none"))?;
        let needed = |name: &str| -> Result<u64, ReadError> {
            self.attribute(points, name)?.ok_or_else(|| self.wrong(points, &format!("an attribute {name}"), "none"))
        };
        let prototype = child(points, "prototype");
        let prototype = prototype.ok_or_else(|| self.wrong(points, "an element prototype", "none"))?;
        let fields = elements(prototype).map(|field| self.field(field)).collect::<Result<Vec<_>, _>>()?;
        if fields.len() > MAX_FIELDS {
            return Err(self.wrong(prototype, &format!("at most {MAX_FIELDS} fields"), &fields.len().to_string()));
        }
        let place = self.byte(scan);
        let count = needed("recordCount")?;
        let section = needed("fileOffset")?;
        if count > 1 && fields.iter().all(|field| field.stored.bits() == 0) {
            return Err(self.wrong(prototype, "a field that tells points apart", "fields of one number each"));
        }
        Ok(Scan { points: count, section, fields, pose: self.pose(scan)?, colors: self.colors(scan)?, place })
    }

    fn field(&self, field: Node<'_, '_>) -> Result<Field, ReadError> {
        let name = field.tag_name().name().to_owned();
        let kind = field.attribute("type").unwrap_or_default();
        if kind == "Float" {
            let stored = match field.attribute("precision") {
                Some("single") => Stored::Single,
                None | Some("double") => Stored::Double,
                Some(other) => return Err(self.wrong(field, "precision single or double", other)),
            };
            let ends: [Option<f64>; 2] = [self.attribute(field, "minimum")?, self.attribute(field, "maximum")?];
            let range = if let [Some(low), Some(high)] = ends { Some([low, high]) } else { None };
            return Ok(Field { name, stored, range: range.filter(|[l, h]| l.is_finite() && h.is_finite() && l < h) });
        }
        if !matches!(kind, "Integer" | "ScaledInteger") {
            return Err(self.wrong(field, &format!("{name} to be Float, Integer or ScaledInteger"), kind));
        }
        let least = self.attribute(field, "minimum")?.unwrap_or(i64::MIN);
        let most = self.attribute(field, "maximum")?.unwrap_or(i64::MAX);
        let is_scaled = kind == "ScaledInteger";
        let coefficient = |name: &str, default: f64| -> Result<f64, ReadError> {
            let number = if is_scaled { self.attribute(field, name)?.unwrap_or(default) } else { default };
            if number.is_finite() {
                Ok(number)
            } else {
                Err(self.wrong(field, &format!("a finite {name}"), &number.to_string()))
            }
        };
        let scale = coefficient("scale", 1.0)?;
        let offset = coefficient("offset", 0.0)?;
        if most < least {
            return Err(self.wrong(field, &format!("{name} to have a maximum above its minimum"), &most.to_string()));
        }
        let stored = Stored::Integer { least, difference: most.abs_diff(least), scale, offset };
        let range = [least, most].map(|end| end as f64 * scale + offset);
        Ok(Field { name, stored, range: Some(range) })
    }

    fn pose(&self, scan: Node<'_, '_>) -> Result<Pose, ReadError> {
        let pose = child(scan, "pose");
        let [rotation, translation] = ["rotation", "translation"].map(|name| pose.and_then(|pose| child(pose, name)));
        let translation = match translation {
            Some(node) => DVec3::from_array(self.numbers(node, ["x", "y", "z"], 0.0)?),
            None => DVec3::ZERO,
        };
        let Some(node) = rotation else { return Ok(Pose { rotation: DQuat::IDENTITY, translation }) };
        let [x, y, z, w] = self.numbers(node, ["x", "y", "z", "w"], 0.0)?;
        let rotation = DQuat::from_xyzw(x, y, z, w);
        if (rotation.length() - 1.0).abs() > SLACK {
            let found = format!("{w}, {x}, {y}, {z}");
            return Err(self.wrong(node, "a rotation as a quaternion of length 1", &found));
        }
        Ok(Pose { rotation: rotation.normalize(), translation })
    }

    /// The lowest and highest colours, where both are told of all three.
    fn colors(&self, scan: Node<'_, '_>) -> Result<Option<[[f64; 2]; 3]>, ReadError> {
        let Some(node) = child(scan, "colorLimits") else { return Ok(None) };
        let mut limits = [[0.0; 2]; 3];
        for (limit, color) in limits.iter_mut().zip(["colorRed", "colorGreen", "colorBlue"]) {
            let names = ["Minimum", "Maximum"].map(|end| format!("{color}{end}"));
            if names.iter().any(|name| child(node, name).is_none()) {
                return Ok(None);
            }
            *limit = self.numbers(node, [&names[0], &names[1]], 0.0)?;
        }
        Ok(limits.iter().all(|[low, high]| low < high).then_some(limits))
    }
}
