//! Images decoded, texts and fonts read once, and what is derived from them, shared by all nodes that show the same.

use std::any::Any;
use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::{FontError, Image, ImageError, NodeKey, Pixels, TextError, Typeface, text};
use crate::action::{ProgramBasis, SceneProgram, ShapeError};
use crate::node::MeshInputs;
use crate::terrain::{HeightField, HeightFieldError, SampleRect, Terrain};

/// A cache keyed by file name, and by image identity and parameters. Everything is made when it is asked for first and
/// kept as long as the scene.
#[derive(Debug, Default)]
pub struct Resources {
    images: Mutex<HashMap<std::path::PathBuf, Result<Arc<Image>, ImageError>>>,
    texts: Mutex<HashMap<std::path::PathBuf, Result<Arc<str>, TextError>>>,
    typefaces: Mutex<HashMap<std::path::PathBuf, Result<Arc<Typeface>, FontError>>>,
    terrains: Mutex<HashMap<TerrainKey, TerrainResult>>,
    meshes: Mutex<HashMap<NodeKey, Vec<(MeshInputs, Made)>>>,
    programs: Mutex<Programs>,
    version: AtomicU64,
}

/// What a map depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct TerrainKey {
    image: u64,
    /// Bits of the sample that marks a void.
    void_sample: Option<u64>,
    holes: bool,
}

/// Most meshes that are kept of one node: a set of faces that is shared below different coordinates has one for each.
const MESHES: usize = 8;

/// A mesh of a type that its node knows.
type Made = Result<Arc<dyn Any + Send + Sync>, ShapeError>;
/// By node, with its fragment shader and without.
type Programs = HashMap<(NodeKey, bool), (ProgramBasis, Arc<SceneProgram>)>;
type TerrainResult = Result<Arc<Terrain>, HeightFieldError>;

fn map(image: &Image, void_sample: Option<f64>, holes: bool) -> Result<HeightField, HeightFieldError> {
    let field = image.height_field(void_sample)?;
    Ok(if holes { field.with_holes() } else { field })
}

impl Resources {
    /// The image in a file, decoded when first asked for.
    ///
    /// # Errors
    ///
    /// [`ImageError`]; the same error again for the same file until [`Resources::forget`] is called.
    pub fn image(&self, path: &Path) -> Result<Arc<Image>, ImageError> {
        let mut images = self.images.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = images.get(path) {
            return found.clone();
        }
        let made = Image::open(path).map(Arc::new);
        images.insert(path.to_owned(), made.clone());
        made
    }

    /// The text in a file, read when first asked for.
    ///
    /// # Errors
    ///
    /// [`TextError`]; the same error again for the same file until [`Resources::forget`] is called.
    pub fn text(&self, path: &Path) -> Result<Arc<str>, TextError> {
        let mut texts = self.texts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = texts.get(path) {
            return found.clone();
        }
        let read = text::read(path);
        texts.insert(path.to_owned(), read.clone());
        read
    }

    /// The font in a file, or the one that is always there.
    pub(crate) fn typeface(&self, file: Option<&Path>) -> Result<Arc<Typeface>, FontError> {
        let Some(path) = file else { return Typeface::read(None) };
        let mut typefaces = self.typefaces.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = typefaces.get(path) {
            return found.clone();
        }
        let read = Typeface::read(file);
        typefaces.insert(path.to_owned(), read.clone());
        read
    }

    /// The heights of an image with all that is derived from them. Voids are filled, or left as holes.
    ///
    /// # Errors
    ///
    /// [`HeightFieldError`] when the image is too small or too large for a map.
    pub fn terrain(&self, image: &Image, void_sample: Option<f64>, holes: bool) -> TerrainResult {
        let key = TerrainKey { image: image.id(), void_sample: void_sample.map(f64::to_bits), holes };
        let mut terrains = self.terrains.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = terrains.get(&key) {
            return found.clone();
        }
        let made = map(image, void_sample, holes).map(|field| Arc::new(Terrain::new(field)));
        terrains.insert(key, made.clone());
        made
    }

    /// Derives the maps of an edited image from those of the image that it was before, which are dropped unless they are
    /// still `used`. `with` are the new pixels of the rectangle.
    pub(super) fn edited(&self, before: u64, used: bool, image: &Image, rect: SampleRect, with: &Pixels) {
        let mut terrains = self.terrains.lock().unwrap_or_else(PoisonError::into_inner);
        let keys: Vec<_> = terrains.keys().copied().filter(|key| key.image == before).collect();
        for key in keys {
            let void_sample = key.void_sample.map(f64::from_bits);
            let old = if used { terrains.get(&key).cloned() } else { terrains.remove(&key) };
            let Some(Ok(old)) = old else { continue };
            let (samples, voids) = with.samples(void_sample);
            let made = match old.with_samples(rect, &samples, voids) {
                Ok(edited) => Ok(Arc::new(edited)),
                // Voids are filled from heights far away: all of the map anew, and what differs is seen by comparing.
                Err(old) => map(image, void_sample, key.holes).map(|field| Arc::new(old.edited(field))),
            };
            terrains.insert(TerrainKey { image: image.id(), ..key }, made);
        }
    }

    /// The mesh of a set of faces, lines or points; made when nothing that it depends on is what it was.
    pub(crate) fn mesh<T: Any + Send + Sync>(
        &self,
        key: Option<NodeKey>,
        inputs: MeshInputs,
        make: impl FnOnce(&MeshInputs) -> Result<T, ShapeError>,
    ) -> Result<Arc<T>, ShapeError> {
        let Some(key) = key else { return make(&inputs).map(Arc::new) };
        let meshes = || self.meshes.lock().unwrap_or_else(PoisonError::into_inner);
        // A node whose meshes are of another type is another node by now.
        let found = |(known, mesh): &(MeshInputs, Made)| {
            let mesh = known.same(&inputs).then(|| mesh.clone())?;
            mesh.map(|mesh| mesh.downcast().ok()).transpose()
        };
        if let Some(mesh) = meshes().get(&key).and_then(|kept| kept.iter().find_map(found)) {
            return mesh;
        }
        // Made without the lock: others go on, and two that make the same make it equal.
        let mesh = make(&inputs).map(Arc::new);
        let mut meshes = meshes();
        let kept = meshes.entry(key).or_default();
        kept.retain(|(known, _)| !known.outdated_by(&inputs));
        if kept.len() >= MESHES {
            drop(kept.remove(0));
        }
        kept.push((inputs, mesh.clone().map(|mesh| mesh as _)));
        mesh
    }

    /// The shaders of a program, with that of fragments or without; read anew when something that they depend on has changed. So the
    /// same program is the same from frame to frame, and nobody has to look at its texts.
    pub(crate) fn program(
        &self,
        key: (NodeKey, bool),
        basis: ProgramBasis,
        make: impl FnOnce() -> Result<SceneProgram, ShapeError>,
    ) -> Result<Arc<SceneProgram>, ShapeError> {
        let programs = || self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, program)) = programs().get(&key)
            && *known == basis
        {
            return Ok(Arc::clone(program));
        }
        let made = Arc::new(make()?);
        programs().insert(key, (basis, Arc::clone(&made)));
        Ok(made)
    }

    /// Forgets what was made of a node that is gone.
    pub(crate) fn forget_node(&self, key: NodeKey) {
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        [false, true].into_iter().for_each(|fragments| drop(programs.remove(&(key, fragments))));
        drop(programs);
        self.meshes.lock().unwrap_or_else(PoisonError::into_inner).remove(&key);
    }

    /// Number of images decoded so far.
    #[must_use]
    pub fn decoded(&self) -> usize {
        let images = self.images.lock().unwrap_or_else(PoisonError::into_inner);
        images.values().filter(|image| image.is_ok()).count()
    }

    /// Forgets all images, texts and fonts, so that files are read again when next asked for.
    pub fn forget(&self) {
        self.images.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.texts.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.typefaces.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.terrains.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.version.fetch_add(1, Ordering::Release);
    }

    /// Raised whenever files may be read again.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.version.load(Ordering::Acquire)
    }
}
