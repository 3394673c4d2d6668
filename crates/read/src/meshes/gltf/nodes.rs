//! The nodes of the scene that is shown, each with its place in it.

use super::accessor::{Buffers, missing};
use super::document::{Copies, Document, Node};
use super::wrong;
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::glam::{DMat4, DQuat, DVec3};

/// A mesh of the scene.
pub(super) struct Instance<'a> {
    pub(super) node: &'a Node,
    pub(super) mesh: usize,
    pub(super) scene_from_mesh: DMat4,
}

/// The meshes of the default scene, else of the first one, else of all nodes; parents before children, in the file's order.
pub(super) fn instances(document: &Document) -> Result<Vec<Instance<'_>>, ReadError> {
    let nodes = &document.nodes;
    let roots = match document.scenes.get(document.scene.unwrap_or(0)) {
        Some(scene) => scene.nodes.clone(),
        None if document.scene.is_some() => {
            return Err(missing("scene", document.scene.unwrap_or(0), document.scenes.len()));
        }
        None => {
            let mut is_child = vec![false; nodes.len()];
            for child in nodes.iter().flat_map(|n| &n.children) {
                if let Some(is_child) = is_child.get_mut(*child) {
                    *is_child = true;
                }
            }
            (0..nodes.len()).filter(|i| !is_child[*i]).collect()
        }
    };
    let mut was_seen = vec![false; nodes.len()];
    let mut waiting: Vec<(usize, DMat4)> = roots.iter().rev().map(|i| (*i, DMat4::IDENTITY)).collect();
    let mut found = Vec::new();
    while let Some((index, scene_from_parent)) = waiting.pop() {
        let node = nodes.get(index).ok_or_else(|| missing("node", index, nodes.len()))?;
        if std::mem::replace(&mut was_seen[index], true) {
            return Err(wrong("nodes that have one parent each".into(), format!("two ways to node {index}")));
        }
        let scene_from_node = scene_from_parent * parent_from_node(node, index)?;
        if let Some(mesh) = node.mesh {
            found.push(Instance { node, mesh, scene_from_mesh: scene_from_node });
        }
        waiting.extend(node.children.iter().rev().map(|i| (*i, scene_from_node)));
    }
    Ok(found)
}

/// The meshes with the copies that `EXT_mesh_gpu_instancing` makes of them, each in its place.
pub(super) fn with_copies<'a>(
    instances: Vec<Instance<'a>>,
    buffers: &Buffers<'_>,
    reading: &mut Reading<'_>,
) -> Result<Vec<Instance<'a>>, ReadError> {
    let mut found = Vec::new();
    for instance in instances {
        let Some(copies) = &instance.node.extensions.copies else {
            found.push(instance);
            continue;
        };
        let places = node_from_copies(copies, buffers, reading)?;
        input::hold("the copies of a mesh", (found.len() + places.len()) as u64 * BYTES_PER_COPY, reading.params)?;
        input::reserve(&mut found, places.len())?;
        let scene_from_node = instance.scene_from_mesh;
        let copy = |node_from_copy: &DMat4| Instance { scene_from_mesh: scene_from_node * *node_from_copy, ..instance };
        found.extend(places.iter().map(copy));
    }
    Ok(found)
}

/// Bytes that the place of a copy takes, with its attributes: a shift, a turn and a scale.
const BYTES_PER_COPY: u64 = (size_of::<Instance<'_>>() + size_of::<DMat4>() + (3 + 4 + 3) * size_of::<f32>()) as u64;

/// The transforms of the copies of a mesh: scaled, then turned, then moved.
fn node_from_copies(
    copies: &Copies,
    buffers: &Buffers<'_>,
    reading: &mut Reading<'_>,
) -> Result<Vec<DMat4>, ReadError> {
    const USED: [&str; 3] = ["TRANSLATION", "ROTATION", "SCALE"];
    let unused = copies.attributes.keys().filter(|name| !USED.contains(&name.as_str()));
    let unused: Vec<String> = unused.map(|name| format!("{name} of copies")).collect();
    reading.notes.not_used(unused.iter().map(String::as_bytes));
    let Some(count) = USED.iter().find_map(|name| copies.attributes.get(*name)).map(|index| buffers.count(*index))
    else {
        return Ok(vec![DMat4::IDENTITY]);
    };
    input::hold("the copies of a mesh", count * BYTES_PER_COPY, reading.params)?;
    let vectors =
        |name: &str| copies.attributes.get(name).map(|index| buffers.vectors::<3>(*index, name, reading)).transpose();
    let moved = vectors("TRANSLATION")?;
    let scaled = vectors("SCALE")?;
    let turned = copies.attributes.get("ROTATION").map(|index| buffers.vectors::<4>(*index, "ROTATION", reading));
    let turned = turned.transpose()?;
    let lengths = [moved.as_ref().map(Vec::len), turned.as_ref().map(Vec::len), scaled.as_ref().map(Vec::len)];
    if let Some(other) = lengths.into_iter().flatten().find(|length| *length as u64 != count) {
        return Err(wrong(format!("{count} entries of each attribute of copies"), other.to_string()));
    }
    let place = |i: usize| {
        let vector = |attribute: &Option<Vec<[f32; 3]>>, usual: DVec3| {
            attribute.as_ref().map_or(usual, |vectors| DVec3::from_array(vectors[i].map(f64::from)))
        };
        let rotation = turned.as_ref().map_or(DQuat::IDENTITY, |turns| DQuat::from_array(turns[i].map(f64::from)));
        let node_from_copy = DMat4::from_scale_rotation_translation(
            vector(&scaled, DVec3::ONE),
            if rotation.length_squared() > 0.0 { rotation.normalize() } else { rotation },
            vector(&moved, DVec3::ZERO),
        );
        if node_from_copy.is_finite() && rotation.length_squared() > 0.0 {
            Ok(node_from_copy)
        } else {
            Err(wrong(format!("a finite place of copy {i}"), "another one".into()))
        }
    };
    (0..count as usize).map(place).collect()
}

fn parent_from_node(node: &Node, index: usize) -> Result<DMat4, ReadError> {
    let rotation = node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    let local = match node.matrix {
        Some(matrix) => DMat4::from_cols_array(&matrix),
        None => DMat4::from_scale_rotation_translation(
            node.scale.map_or(DVec3::ONE, DVec3::from_array),
            // Written in decimal, it is not exactly of length 1.
            if rotation.length_squared() > 0.0 { rotation.normalize() } else { rotation },
            node.translation.map_or(DVec3::ZERO, DVec3::from_array),
        ),
    };
    let is_affine = local.row(3).to_array() == [0.0, 0.0, 0.0, 1.0];
    if local.is_finite() && is_affine && rotation.length_squared() > 0.0 {
        return Ok(local);
    }
    Err(wrong(format!("an affine transform of node {index}"), "another one".into()))
}
