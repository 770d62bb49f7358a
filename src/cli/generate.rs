use std::io;
use std::path::PathBuf;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use seamount::format::{check_target, write_file};
use seamount::terrain::{self, Samples};

use super::{Failure, Outcome};

/// Write a procedural height map.
///
/// A 16-bit PNG of ridged multifractal noise, values over the whole range. The same size and seed give the same samples on
/// every machine. Takes about 10 bytes of memory per sample.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Samples a side
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=32769))]
    size: u32,
    /// Any number; another one gives another land
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The file to write
    #[arg(short, long, value_name = "MAP.png")]
    output: PathBuf,
}

pub(super) fn run(args: &Args) -> Outcome {
    check_target(&args.output)?;
    let map = terrain::generate(args.size, args.seed)?;
    let Samples::U16(samples) = map.samples() else {
        return Err(Failure::Error("the generated map is not of 16 bits".to_owned()));
    };
    write_file(&args.output, |out| {
        let encoder = PngEncoder::new_with_quality(out, CompressionType::Fast, FilterType::Sub);
        encoder.write_image(bytemuck::cast_slice(samples), map.columns(), map.rows(), ExtendedColorType::L16).map_err(
            |error| match error {
                image::ImageError::IoError(error) => error,
                other => io::Error::other(other),
            },
        )
    })?;
    Ok(())
}
