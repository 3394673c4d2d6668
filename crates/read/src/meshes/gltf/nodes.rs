//! The nodes of the scene that is shown, each with its place in it.

use super::accessor::missing;
use super::document::{Document, Node};
use super::wrong;
use crate::error::ReadError;
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
