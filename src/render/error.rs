//! What can go wrong between a frame and its picture.

use thiserror::Error;

use crate::action::ShaderOrigin;
use crate::scene::Position;

/// Why there is no picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// No graphics adapter was found, or none of the name asked for.
    #[error("{}", no_adapter(.wanted.as_deref(), .found))]
    NoAdapter {
        /// Part of the name that was asked for.
        wanted: Option<String>,
        /// Names of the adapters there are.
        found: Vec<String>,
    },
    /// The adapter gave no device.
    #[error("the adapter {adapter} gives no device: {reason}. Choose another one by name, or update its driver")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// The picture is empty or larger than the device's textures may be.
    #[error("a picture of {width} × {height} pixels can not be drawn: this device takes 1 to {limit} a side")]
    PictureSize {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// Largest side of a texture (`max_texture_dimension_2d`).
        limit: u32,
    },
    /// An image or map is larger than the device's textures may be.
    #[error(
        "{what} of {width} × {height} does not fit on this device: textures may have up to {limit} a side \
         (max_texture_dimension_2d). Make it smaller, or ask for the adapter's own limits when making the device"
    )]
    TextureSize {
        /// What it is.
        what: &'static str,
        /// Samples from west to east.
        width: u32,
        /// Samples from north to south.
        height: u32,
        /// Largest side of a texture.
        limit: u32,
    },
    /// The effects of a draw contradict each other or its geometry.
    #[error("this can not be drawn: {0}")]
    Effects(&'static str),
    /// A shader could not be put together.
    #[error("the shader could not be put together: {0}")]
    Shader(String),
    /// A mistake in a shader of the scene's own.
    #[error("{}", user_shader(.origin, *.at, .message))]
    UserShader {
        /// Where its text stands.
        origin: ShaderOrigin,
        /// The place in the text.
        at: Position,
        /// What is wrong, in the words of the compiler.
        message: String,
    },
    /// A shader's parameter has a name that no shader can have.
    #[error("{message}; choose another name for the parameter")]
    Parameter {
        /// What is wrong.
        message: String,
    },
    /// The device has not enough memory.
    #[error("out of graphics memory while {doing}: try a smaller picture or map, or another adapter")]
    OutOfMemory {
        /// What needed the memory.
        doing: &'static str,
    },
    /// The device refused something.
    #[error("the graphics device refused {doing}: {message}")]
    Device {
        /// What was being done.
        doing: &'static str,
        /// What wgpu said.
        message: String,
    },
}

fn no_adapter(wanted: Option<&str>, found: &[String]) -> String {
    let looked = "looked for Vulkan, Metal and Direct3D 12 adapters";
    let help = "on Debian the package mesa-vulkan-drivers has a software driver that needs no graphics hardware";
    match (wanted, found) {
        (None, _) => format!("no graphics adapter: {looked} and found none; {help}"),
        (Some(name), []) => format!("no graphics adapter with \"{name}\" in its name: {looked} and found none; {help}"),
        (Some(name), found) => {
            format!("no graphics adapter has \"{name}\" in its name: {looked} and found {}; {help}", found.join(", "))
        }
    }
}

/// `file:line:column: message`, or the node and the place in its text.
fn user_shader(origin: &ShaderOrigin, at: Position, message: &str) -> String {
    match origin {
        ShaderOrigin::File(path) => format!("{}:{at}: {message}", path.display()),
        ShaderOrigin::Node(_) => {
            let Position { line, column } = at;
            format!("{origin}: `source_program`, line {line}, column {column}: {message}")
        }
    }
}

/// Runs what may be refused by the device, and turns what it reports into an error.
pub(super) fn guarded<T>(
    device: &wgpu::Device,
    doing: &'static str,
    work: impl FnOnce() -> T,
) -> Result<T, RenderError> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let value = work();
    let (internal, validation, memory) = (internal.pop(), validation.pop(), memory.pop());
    let reported = pollster::block_on(async { [memory.await, validation.await, internal.await] });
    match reported.into_iter().flatten().next() {
        None => Ok(value),
        Some(wgpu::Error::OutOfMemory { .. }) => Err(RenderError::OutOfMemory { doing }),
        Some(error) => Err(RenderError::Device { doing, message: error.to_string() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_adapter_says_what_was_looked_for_and_what_helps() {
        let error = |wanted: Option<&str>, found: &[&str]| {
            RenderError::NoAdapter {
                wanted: wanted.map(str::to_owned),
                found: found.iter().map(|&f| f.to_owned()).collect(),
            }
            .to_string()
        };
        let none = error(None, &[]);
        assert!(none.contains("Vulkan") && none.contains("mesa-vulkan-drivers"), "{none}");
        let other = error(Some("Radeon"), &["llvmpipe (CPU)"]);
        assert!(other.contains("\"Radeon\"") && other.contains("llvmpipe (CPU)"), "{other}");
        assert!(other.contains("mesa-vulkan-drivers"), "{other}");
    }
}
