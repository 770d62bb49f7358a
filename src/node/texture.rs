use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{PropertyNode, field::enum_field};
use crate::action::{PropertyContext, State, TextureSource};
use crate::scene::Image;

crate::define_node! {
    /// Chooses the texture unit that the textures that follow are put on.
    ///
    /// With the built-in program unit 0 carries the heights of terrains, and unit 1 the colours of all shapes; where unit 1 is empty
    /// meshes show unit 0, so that scenes without terrains need no TextureUnit. Kept by all actions.
    ///
    /// ```ron
    /// TextureUnit(unit: 1)
    /// ```
    pub struct TextureUnit: property {
        /// Number of the unit.
        pub unit: u32 = 0,
    }
    actions {
        Render: "shows the textures that follow as this unit is shown";
        BoundingBox, RayPick, HandleEvent, Callback, PrimitiveCount: "look for heights on the unit that carries them";
    }
}

impl PropertyNode for TextureUnit {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.unit = self.unit;
    }
}

/// What a texture shows beyond its border.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum Wrap {
    /// It repeats.
    #[default]
    Repeat,
    /// Its border goes on.
    Clamp,
}

enum_field!(Wrap: Repeat | Clamp);

crate::define_node! {
    /// Puts an image on the current texture unit.
    ///
    /// The image is decoded when an action needs it first: a bounding box reads heights, but no colours. Images of heights
    /// stay at their full depth.
    ///
    /// A terrain lies under its colours edge to edge: what is beyond the border of an image is only seen with a
    /// `Texture2Transform`, and without one the border does not mix with the one opposite. On sets of faces, plain shapes and those of
    /// your own that give texture coordinates the image lies by these, as picks tell them: given ones, those of the shape, or
    /// those worked out from its box. The image multiplies the diffuse and ambient colour (Open Inventor's MODULATE), and its alpha
    /// the opacity of meshes: they are then drawn as what is transparent is, and where alpha is 0 nothing is. Lines and points
    /// show none.
    ///
    /// ```ron
    /// Texture2(filename: "map.png")
    /// ```
    pub struct Texture2: property {
        /// File name, relative to the folder of the file in which it stands. PNG, JPEG, TIFF or PNM. Empty takes the texture away.
        pub filename: String = String::new(),
        /// What is shown beyond the left and right border.
        pub wrap_s: Wrap = Wrap::Repeat,
        /// What is shown beyond the upper and lower border.
        pub wrap_t: Wrap = Wrap::Repeat,
        transient:
        /// An image from memory; goes before `filename`. Not in scene files.
        pub image: Option<ImageRef> = None,
    }
    actions {
        Render: "lays it over what follows, or takes heights from it";
        BoundingBox, RayPick, HandleEvent, Callback, PrimitiveCount: "take heights from it, where it carries heights";
    }
}

/// An image shared with a node; two are equal if they are the same image.
#[derive(Debug, Clone)]
pub struct ImageRef(pub Arc<Image>);

impl PartialEq for ImageRef {
    fn eq(&self, other: &Self) -> bool {
        self.0.id() == other.0.id()
    }
}

impl Texture2 {
    /// A texture from an image in memory.
    ///
    /// ```
    /// use seamount::prelude::*;
    /// use seamount::scene::{Image, Pixels};
    ///
    /// let ramp = Image::new(2, 2, Pixels::GrayF32(vec![0.0, 1.0, 1.0, 2.0]))?;
    /// let texture = Texture2::from_image(ramp);
    /// assert!(texture.image.is_some());
    /// # Ok::<(), seamount::scene::ImageError>(())
    /// ```
    #[must_use]
    pub fn from_image(image: impl Into<Arc<Image>>) -> Self {
        Self { image: Some(ImageRef(image.into())), ..Self::default() }
    }
}

impl PropertyNode for Texture2 {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let source = match &self.image {
            Some(image) => Some(TextureSource::Memory(Arc::clone(&image.0))),
            None if self.filename.is_empty() => None,
            None => Some(TextureSource::File(cx.scene.resolve(cx.key, &self.filename))),
        };
        state.set_texture(source, [self.wrap_s, self.wrap_t], cx);
    }
}
