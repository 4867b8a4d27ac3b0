//! Channels of a file of maps, picked by name; or the difference of the halves of the pupil, of a sample's `disparity.exr`.
//!
//! ```text
//! left-right = mean dx of the left views − mean dx of the right ones          top-bottom = the same of dy, top and bottom
//! ```

use std::path::Path;

use quadpixel::command::CommandError;
use quadpixel::image::exr::NamedLayer;
use quadpixel::image::{Image, channel};

use crate::maps;
use crate::sai::{Partition, Side};

/// The channels `names` of a file, or those that there is no doubt about; 1 or 2 pictures of one channel.
pub fn chosen(path: &Path, names: &[String], option: &str) -> Result<Vec<Image>, CommandError> {
    let layers = maps::read(path).map_err(CommandError::input)?;
    let all: Vec<(String, &NamedLayer, usize)> = (layers.iter())
        .flat_map(|layer| {
            let parted = if layer.name.is_empty() { "" } else { "." };
            (layer.channels.iter().enumerate())
                .map(move |(c, name)| (format!("{}{parted}{name}", layer.name), layer, c))
        })
        .collect();
    let bad = |what: String| {
        let known: Vec<&str> = all.iter().map(|(name, _, _)| name.as_str()).collect();
        CommandError::input(format!(
            "{}: {what}; it has {}",
            path.display(),
            known.join(" ")
        ))
    };
    let named = |wanted: &str| {
        let found = all.iter().find(|(name, _, _)| name == wanted);
        found.map(|(_, layer, c)| channel(&layer.image, *c))
    };
    match names {
        [] => match all.as_slice() {
            [(_, layer, _)] => Ok(vec![layer.image.clone()]),
            _ => {
                let single = (layers.len() == 1).then(|| layers[0].name.as_str());
                let prefix = single
                    .filter(|name| !name.is_empty())
                    .map(|n| format!("{n}."));
                let prefix = prefix.unwrap_or_default();
                let both = ["dx", "dy"].map(|c| named(&format!("{prefix}{c}")));
                match (single, both) {
                    (Some(_), [Some(dx), Some(dy)]) => Ok(vec![dx, dy]),
                    _ => Err(bad(format!(
                        "which channels is left open: name them by {option}"
                    ))),
                }
            }
        },
        [one] if one == "left-right" || one == "top-bottom" => {
            let (sides, axis) = match one.as_str() {
                "left-right" => ([Side::Left, Side::Right], "dx"),
                _ => ([Side::Top, Side::Bottom], "dy"),
            };
            let map = between(&layers, sides, axis);
            Ok(vec![map.ok_or_else(|| {
                bad(format!(
                    "{option} {one}: it is no sample's disparity.exr with such views"
                ))
            })?])
        }
        [_] | [_, _] => {
            let images = (names.iter())
                .map(|name| {
                    named(name).ok_or_else(|| bad(format!("{option} {name}: no such channel")))
                })
                .collect::<Result<Vec<_>, _>>()?;
            let size = |image: &Image| (image.width(), image.height());
            if images.iter().any(|image| size(image) != size(&images[0])) {
                return Err(bad(format!("{option}: the two are not of one size")));
            }
            Ok(images)
        }
        _ => Err(CommandError::input(format!(
            "{option}: {} channels; allowed are one or two",
            names.len()
        ))),
    }
}

/// Mean of channel `axis` over the views of the first side minus that over the second.
fn between(layers: &[NamedLayer], sides: [Side; 2], axis: &str) -> Option<Image> {
    let names: Vec<&str> = layers.iter().map(|l| l.name.as_str()).collect();
    let partition = Partition::of_names(&names)?;
    let first = &layers.first()?.image;
    let mut map = Image::zeros(first.width(), first.height(), 1);
    for (side, sign) in sides.into_iter().zip([1.0, -1.0]) {
        let members = partition.side(side);
        if members.is_empty() {
            return None;
        }
        for &member in &members {
            let name = partition.name(member);
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
