//! The colours that shapes hand out to their parts, faces and corners.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::{Vec3, Vec4};

use super::{DrawContext, ShapeError, State};
use crate::node::{Binding, Color, List};

/// The diffuse colours in force with their opacity: those of the Material, or of a VertexProperty.
///
/// # Example
///
/// ```
/// use seamount::action::State;
///
/// let mut state = State::default();
/// assert_eq!(state.colors().count(), 1);
/// state.packed_colors = [0xff0000ff, 0x0000ff00].into();
/// let colors = state.colors();
/// assert_eq!(colors.get(1).map(|c| c.to_array()), Some([0.0, 0.0, 1.0, 0.0]));
/// assert_eq!((colors.get(2), colors.see_through()), (None, true));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceColors {
    diffuse: List<Color>,
    transparency: List<f32>,
    packed: List<u32>,
}

impl State {
    /// The colours that shapes hand out to their parts, faces and corners as
    /// [`Properties::material_binding`](super::Properties::material_binding) says.
    #[must_use]
    pub fn colors(&self) -> SurfaceColors {
        let material = &self.material;
        let (diffuse, transparency) = (material.diffuse_color.clone(), material.transparency.clone());
        SurfaceColors { diffuse, transparency, packed: self.packed_colors.clone() }
    }
}

impl SurfaceColors {
    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        if self.packed.is_empty() { self.diffuse.len() } else { self.packed.len() }
    }

    /// Red, green and blue in linear light, and opacity, 0..1, of a number from 0 on.
    #[must_use]
    pub fn get(&self, number: usize) -> Option<Vec4> {
        if let Some(packed) = self.packed.get(number) {
            let [r, g, b, a] = packed.to_be_bytes().map(|c| f32::from(c) / 255.0);
            return Some(Color::new(r, g, b).linear().extend(a));
        }
        let color = self.diffuse.get(number).filter(|_| self.packed.is_empty())?.linear();
        let transparency = self.transparency.get(number).or(self.transparency.last());
        Some(color.extend(1.0 - transparency.copied().unwrap_or(0.0)))
    }

    /// The first, which is that of all of a shape unless there are several and a binding.
    #[must_use]
    pub fn first(&self) -> Vec4 {
        self.get(0).unwrap_or(Vec3::splat(0.8).extend(1.0))
    }

    fn opacities(&self) -> impl Iterator<Item = f32> {
        let packed = self.packed.iter().map(|packed| f32::from(*packed as u8) / 255.0);
        let of_material = self.transparency.iter().filter(|_| self.packed.is_empty());
        packed.chain(of_material.map(|transparency| 1.0 - transparency))
    }

    /// Whether any lets through what is behind.
    #[must_use]
    pub fn see_through(&self) -> bool {
        self.opacities().any(|opacity| opacity < 1.0)
    }

    /// Whether none is to be seen at all.
    #[must_use]
    pub fn invisible(&self) -> bool {
        self.opacities().all(|opacity| opacity <= 0.0)
    }

    /// [`SurfaceColors::get`], or what is wrong with the number. `who`: what has it, and which of them.
    pub(crate) fn of(&self, number: u32, binding: Binding, who: (&str, usize)) -> Result<Vec4, ShapeError> {
        self.get(number as usize).ok_or_else(|| ShapeError::Field {
            field: if binding.is_indexed() { "material_index" } else { "MaterialBinding" },
            message: format!(
                "{} {} asks for colour number {number}: there are {}, from 0 to {}",
                who.0,
                who.1,
                self.count(),
                self.count().saturating_sub(1)
            ),
        })
    }
}

/// What the corners of a mesh carry beside place and normal, because the State calls for it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CornerData {
    /// The colours, where they differ over the shape.
    pub colors: Option<SurfaceColors>,
    /// Whether they have texture coordinates, since there is a texture.
    pub uvs: bool,
}

impl DrawContext<'_> {
    /// What the corners of a mesh, or the ends of lines, have to carry.
    #[must_use]
    pub fn corner_data(&self) -> CornerData {
        let state = self.shape.state;
        let bound = state.material_binding != Binding::Overall;
        CornerData {
            colors: bound.then(|| state.colors()).filter(|colors| colors.count() > 1),
            uvs: state.texture(state.color_unit()).is_some(),
        }
    }
}
