//! From a [`Frame`](crate::action::Frame) to pixels, with wgpu.
//!
//! [`Renderer`] draws into a device, queue and texture view that the caller owns. [`Headless`] is a thin user of it: it
//! finds an adapter, makes a device and a target, and reads the picture back.
//!
//! # What is on the GPU
//!
//! A terrain has no vertices in memory. One index buffer holds the parts of a patch, an index being a place in the patch;
//! an instance is 12 bytes that say where a part lies; the height is read from the map, at the depth of its file, by the
//! integer coordinates of the lattice point. The same point has the same bits whichever patch asks for it, so that no gap
//! can open between two patches.
//!
//! # Effects
//!
//! Shader text, bindings and uniforms follow from the [`Effects`](crate::action::Effects) of a draw: they are put
//! together from the modules in `shaders/` with conditional translation (WESL), and what was not asked for is in none of
//! them. [`shader_text`] shows the result. Each variant is compiled once per renderer. Shaders of a scene's own follow our text as
//! they were written; [`draw_text`] shows the whole.
//!
//! # Depth
//!
//! Reversed z in 32-bit floats: 1 at the near plane, 0 infinitely far away. Of two fragments at one depth the later is
//! seen, as in Open Inventor.

mod bindings;
mod buffers;
mod cache;
mod error;
mod headless;
mod mips;
mod objects;
mod picture;
mod pipelines;
mod program;
mod renderer;
mod shader;
mod targets;
mod textures;
mod timer;
mod uniforms;

pub use error::RenderError;
pub use headless::Headless;
pub use objects::ObjectsMade;
pub use picture::Picture;
pub use program::{check_shaders, draw_text};
pub use renderer::{DrawCost, DrawReport, Renderer, RendererOptions};
pub use shader::shader_text;
