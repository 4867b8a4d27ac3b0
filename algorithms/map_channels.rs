//! Channels of a file of maps, picked by name; or the difference of the halves of the pupil, of a sample's
//! `disparity.exr`.
//!
//! ```text
//! left-right = mean dx of the left views − mean dx of the right ones
//! top-bottom = the same of dy, top and bottom
//! ```

use std::path::{Path, PathBuf};

use quadpixel::image::exr::NamedLayer;
use quadpixel::image::{Image, ImageError, channel};
use quadpixel::sensor::Subpixels;

use crate::maps;
use crate::sai::Side;

/// Channels that cannot be picked.
#[derive(Debug, thiserror::Error)]
pub enum ChannelError {
    /// The file cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// More or fewer than one or two names.
    #[error("{0} channels; allowed are one or two")]
    Count(usize),
    /// No such channels in the file.
    #[error("{}: {why}; it has {known}", path.display())]
    NotThere {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        why: String,
        /// Names of the channels that it has.
        known: String,
    },
}

/// A file's maps with the full names of their channels, `LAYER.CHANNEL`.
struct NamedChannels<'a> {
    path: &'a Path,
    layers: &'a [NamedLayer],
    names: Vec<(String, &'a NamedLayer, usize)>,
}

/// The channels `names` of a file, or those that there is no doubt about; 1 or 2 pictures of one channel.
///
/// # Errors
/// The file cannot be read, has no such channels, or more than one choice where none was named.
pub fn read_channels(path: &Path, names: &[String]) -> Result<Vec<Image>, ChannelError> {
    let layers = maps::read(path)?;
    let all = NamedChannels::new(path, &layers);
    match names {
        [] => all.only_choice(),
        [one] if one == "left-right" || one == "top-bottom" => {
            let (sides, axis) = match one.as_str() {
                "left-right" => ([Side::Left, Side::Right], "dx"),
                _ => ([Side::Top, Side::Bottom], "dy"),
            };
            let map = between(&layers, sides, axis).ok_or_else(|| {
                all.error(format!(
                    "{one}: it is no sample's disparity.exr with such views"
                ))
            })?;
            Ok(vec![map])
        }
        [_] | [_, _] => {
            let images = (names.iter())
                .map(|name| {
                    let image = all.named(name);
                    image.ok_or_else(|| all.error(format!("{name}: no such channel")))
                })
                .collect::<Result<Vec<_>, _>>()?;
            let size = |image: &Image| (image.width(), image.height());
            if images.iter().any(|image| size(image) != size(&images[0])) {
                return Err(all.error("the two are not of one size".to_owned()));
            }
            Ok(images)
        }
        _ => Err(ChannelError::Count(names.len())),
    }
}

impl<'a> NamedChannels<'a> {
    fn new(path: &'a Path, layers: &'a [NamedLayer]) -> Self {
        let names = (layers.iter())
            .flat_map(|layer| {
                let dot = if layer.name.is_empty() { "" } else { "." };
                (layer.channels.iter().enumerate())
                    .map(move |(c, name)| (format!("{}{dot}{name}", layer.name), layer, c))
            })
            .collect();
        Self {
            path,
            layers,
            names,
        }
    }

    fn named(&self, wanted: &str) -> Option<Image> {
        let entry = self.names.iter().find(|(name, _, _)| name == wanted);
        entry.map(|(_, layer, c)| channel(&layer.image, *c))
    }

    /// The only channel, or the only dx and dy.
    fn only_choice(&self) -> Result<Vec<Image>, ChannelError> {
        if let [(_, layer, _)] = self.names.as_slice() {
            return Ok(vec![layer.image.clone()]);
        }
        if let [layer] = self.layers {
            let dot = if layer.name.is_empty() { "" } else { "." };
            let both = ["dx", "dy"].map(|c| self.named(&format!("{}{dot}{c}", layer.name)));
            if let [Some(dx), Some(dy)] = both {
                return Ok(vec![dx, dy]);
            }
        }
        Err(self.error("which channels is left open: name them".to_owned()))
    }

    fn error(&self, why: String) -> ChannelError {
        let known: Vec<&str> = (self.names.iter())
            .map(|(name, _, _)| name.as_str())
            .collect();
        ChannelError::NotThere {
            path: self.path.to_path_buf(),
            why,
            known: known.join(" "),
        }
    }
}

/// Mean of channel `axis` over the views of the first side minus that over the second.
fn between(layers: &[NamedLayer], sides: [Side; 2], axis: &str) -> Option<Image> {
    let names: Vec<&str> = layers.iter().map(|l| l.name.as_str()).collect();
    let subpixels = Subpixels::from_names(&names)?;
    let first = &layers.first()?.image;
    let mut map = Image::zeros(first.width(), first.height(), 1);
    for (side, sign) in sides.into_iter().zip([1.0, -1.0]) {
        let members = side.members(subpixels);
        if members.is_empty() {
            return None;
        }
        for &member in &members {
            let name = subpixels.name(member);
            let layer = layers.iter().find(|l| l.name == name)?;
            let c = layer.channels.iter().position(|c| c == axis)?;
            let scale = sign / members.len() as f32;
            let from = layer
                .image
                .data()
                .iter()
                .skip(c)
                .step_by(layer.channels.len());
            (map.data_mut().iter_mut().zip(from)).for_each(|(to, v)| *to += scale * v);
        }
    }
    Some(map)
}
