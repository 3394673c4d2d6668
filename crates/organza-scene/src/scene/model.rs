//! The checked scene: everything a render needs, in radians and f64 world units.

use crate::source::in_memory::{InMemory, name_of};
use crate::{
    CameraFit, EnvironmentSource, Error, RenderSettings, SceneLight, SceneMaterial, SceneObject, Source, Stop,
    Technique, TechniqueKey,
};
use convert::DiscSize;
use glam::DVec3;
use sha2::{Digest, Sha256};
use splat_core::{Camera, FootprintStack, Projection};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A whole scene. Made by [`crate::load()`] or [`crate::parse`] alone, so that every number in it is finite and in range.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The scene file, as it was named.
    pub file: PathBuf,
    /// SHA-256 of the scene file's bytes, of the overrides from the command line and of the frame, lower-case hex.
    pub sha256: String,
    /// Number of frames of its animation, if it has one.
    pub frames: Option<u32>,
    /// Objects that stop on their way, where it is a frame of its animation and they may have: they are still where their tracks have them.
    pub stops: Vec<Stop>,
    /// The scene at frame 0, where there are stops: what they stop at is as it is then.
    pub start: Option<Arc<Scene>>,
    /// The camera with the image size; where [`Self::fit`] is there, its place is still to be found.
    pub camera: Camera,
    /// The point in the middle of the picture that the scene names, or that was found.
    pub target: DVec3,
    /// How the camera is to be placed, where the scene leaves that to the data.
    pub fit: Option<CameraFit>,
    /// Radiance behind everything, linear Rec.709; black where there is an environment.
    pub background: [f32; 3],
    /// What is seen behind everything in the place of a colour.
    pub environment: Option<EnvironmentSource>,
    /// Ambient radiance, the same from all directions.
    pub ambient: [f32; 3],
    /// Lights in file order.
    pub lights: Vec<SceneLight>,
    /// Objects in file order, invisible ones included.
    pub objects: Vec<SceneObject>,
    /// Materials; entry 0 is the default one, the others are in order of name.
    pub materials: Vec<SceneMaterial>,
    /// How to render.
    pub render: RenderSettings,
    /// Keys that it writes in the tables of techniques, those too that have the value that goes without saying.
    pub technique_keys: Vec<TechniqueKey>,
    /// The footprints that objects name by index.
    pub footprints: FootprintStack,
    /// The files of those that are images.
    pub footprint_files: Vec<PathBuf>,
    /// The data that it names in the place of files.
    pub in_memory: InMemory,
}

impl Scene {
    /// A part of it that becomes splats for a light to see: the objects that `has` says, as they stand, visible or not, and that light. Parts of
    /// two frames are equal where nothing of them changes, wherever they are seen from, unless points are as large as some pixels.
    #[must_use]
    pub fn part(&self, light: usize, has: impl Fn(&SceneObject) -> bool) -> Self {
        let lights = self.lights.get(light).cloned().into_iter().collect();
        let mut scene = Self { sha256: String::new(), stops: Vec::new(), start: None, lights, ..self.clone() };
        scene.render.technique = Technique::Points;
        // What a light sees is data: a picture that has little time does not change it.
        scene.render.splat_share = 1.0;
        scene.objects.retain(has);
        scene.objects.iter_mut().for_each(|o| (o.visible, o.technique) = (true, None));
        if !scene.objects.iter().any(|o| matches!(o.points.size, Some(DiscSize::Pixels(_)))) {
            let position = DVec3::ZERO;
            let axes = [DVec3::X, DVec3::Y, -DVec3::Z];
            let projection = Projection::Orthographic { height: 1.0 };
            let size = [1, 1];
            (scene.camera, scene.target, scene.fit) = (Camera { position, axes, projection, size }, DVec3::ZERO, None);
        }
        scene
    }

    /// The scene by a technique, but for objects that name another: what is left to the plan is drawn by it, too.
    #[must_use]
    pub fn drawn_by(&self, technique: Technique) -> Self {
        let mut scene = self.clone();
        scene.render.technique = technique;
        let open = scene.objects.iter_mut().filter(|object| object.technique == Some(Technique::Auto));
        open.for_each(|object| object.technique = None);
        scene
    }

    /// Every file that the scene is made of, its own first.
    pub fn files(&self) -> Vec<PathBuf> {
        let data = self.objects.iter().flat_map(SceneObject::paths);
        let footprints = self.footprint_files.iter().map(PathBuf::as_path);
        std::iter::once(&*self.file).chain(data).chain(self.images()).chain(footprints).map(Path::to_owned).collect()
    }

    /// The columns that are read of a file of points or a mesh, by name, each once: those that any visible object asks for, so that the file is read
    /// once for all of them.
    pub fn columns_of(&self, path: &Path) -> Vec<String> {
        let of_mesh =
            |o: &&SceneObject| o.visible && o.source.path() == Some(path) && matches!(o.source, Source::Mesh(_));
        let meshes = self.objects.iter().filter(of_mesh);
        let names: BTreeSet<&str> = self.made_of(path).chain(meshes).flat_map(|o| o.points.columns()).collect();
        names.into_iter().map(str::to_owned).collect()
    }

    /// Whether a visible object is a medium of the points of a file.
    pub fn has_matter(&self, path: &Path) -> bool {
        self.made_of(path).any(|o| o.source.is_medium())
    }

    /// The visible objects that are made of the points of a file.
    fn made_of(&self, path: &Path) -> impl Iterator<Item = &SceneObject> {
        let of_points = |o: &&SceneObject| matches!(o.source, Source::Points(_) | Source::Matter(_));
        self.objects.iter().filter(|o| o.visible).filter(of_points).filter(move |o| o.source.path() == Some(path))
    }

    /// The files of its environment, of what lights shine through, and of bumps.
    pub fn images(&self) -> impl Iterator<Item = &Path> {
        let slides = self.lights.iter().filter_map(|light| Some(&*light.slide.as_ref()?.path));
        let bumps = self.materials.iter().filter_map(|material| material.bump_image.as_deref());
        self.environment.iter().map(|environment| &*environment.path).chain(slides).chain(bumps)
    }

    /// SHA-256 of the bytes of all files that the scene reads, without its own.
    ///
    /// # Errors
    /// [`Error::Io`] for one that cannot be read.
    pub fn digest_of_data(&self) -> Result<[u8; 32], Error> {
        let mut hasher = Sha256::new();
        for path in self.files().into_iter().skip(1) {
            if name_of(&path).is_some() {
                self.in_memory.digest(&path, &mut hasher);
                continue;
            }
            // A folder of slices is all of its files.
            let parts = read::files_of(&path).map_err(|e| {
                let source = std::io::Error::other(e.to_string());
                Error::Io { path: path.clone(), action: "cannot read", source }
            })?;
            for path in parts {
                digest_of_file(path, &mut hasher)?;
            }
        }
        Ok(hasher.finalize().into())
    }
}

/// Adds the bytes of a regular file.
fn digest_of_file(path: PathBuf, hasher: &mut Sha256) -> Result<(), Error> {
    // Asked before opening: opening a pipe waits for its writer.
    let regular = std::fs::metadata(&path).and_then(|meta| match meta.is_file() {
        true => Ok(()),
        false => Err(std::io::Error::other("not a regular file")),
    });
    let copied = regular.and_then(|()| File::open(&path)).and_then(|mut file| {
        let mut buffer = vec![0; 1 << 20];
        loop {
            match file.read(&mut buffer)? {
                0 => return Ok(()),
                n => hasher.update(&buffer[..n]),
            }
        }
    });
    copied.map_err(|source| Error::Io { path, action: "cannot read", source })
}
