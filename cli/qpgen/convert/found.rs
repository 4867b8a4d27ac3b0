//! The pairs of pictures and depths that a run converts, and those that it leaves out.

use std::collections::BTreeMap;
use std::path::Path;

use quadpixel_generators::config::{DatasetConfig, RgbdConfig};
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_generators::production::recipes;
use quadpixel_generators::rgbd::{Depths, Meaning, Pair, PictureError, RgbdRecipe, pairs};
use rayon::prelude::*;

use super::ConvertArgs;
use crate::exit::CommandError;
use crate::progress::Progress;

/// The pairs that can be converted, and a line for each that cannot.
pub(super) struct Found {
    good: Vec<(Pair, Depths)>,
    pub skipped: Vec<String>,
}

impl Found {
    /// Reads every pair once: what cannot be converted is told before the first sample.
    pub fn read(
        args: &ConvertArgs,
        meaning: &Meaning,
        progress: &Progress,
    ) -> Result<Self, CommandError> {
        let (all, mut skipped) = match (&args.depth, args.preset) {
            (Some(depth), _) => pairs(&args.image, depth)?,
            (None, Some(preset)) => preset.preset().pairs(&args.image)?,
            (None, None) => return Err(CommandError::input("neither --depth nor --preset")),
        };
        let alone = all.len() == 1;
        let try_one = |pair: &Pair| -> Result<Depths, PictureError> {
            let picture = RgbdRecipe::new(&pair.image, &pair.depth, meaning)?.read()?;
            Ok(Depths::of(&picture))
        };
        let tried: Vec<_> = all.par_iter().map(try_one).collect();
        let mut good = Vec::new();
        for (pair, tried) in all.into_iter().zip(tried) {
            match tried {
                Ok(depths) => good.push((pair, depths)),
                Err(error) if alone => return Err(error.into()),
                Err(error) => skipped.push(error.to_string()),
            }
        }
        for line in &skipped {
            progress.event(Event::Warning(&format!("skipped: {line}")));
        }
        let found = Self { good, skipped };
        found.check(args)?;
        Ok(found)
    }

    /// That there is something to convert.
    fn check(&self, args: &ConvertArgs) -> Result<(), CommandError> {
        match self.good.is_empty() {
            true => Err(CommandError::input(format!(
                "{}: none of the pairs can be converted; the first: {}",
                args.image.display(),
                self.skipped.first().map_or("", String::as_str)
            ))),
            false => Ok(()),
        }
    }

    /// The configuration of the pairs, without those whose blur in one of their samples is larger than themselves. To
    /// leave one out changes which random numbers the others get, so that they are looked at again.
    pub fn configured(
        &mut self,
        args: &ConvertArgs,
        base: &DatasetConfig,
        rgbd: &RgbdConfig,
        progress: &Progress,
    ) -> Result<DatasetConfig, CommandError> {
        let text = |path: &Path| path.display().to_string();
        loop {
            let mut config = base.clone();
            config.count = args.count.unwrap_or(self.good.len());
            config.scene.rgbd = Some(RgbdConfig {
                pairs: (self.good.iter())
                    .map(|(pair, _)| [text(&pair.image), text(&pair.depth)])
                    .collect(),
                ..rgbd.clone()
            });
            if self.good.len() == 1 {
                return Ok(config); // refused with its own error, if it is
            }
            let too_large = self.too_large(&config)?;
            if too_large.is_empty() {
                return Ok(config);
            }
            for (number, line) in too_large.into_iter().rev() {
                progress.event(Event::Warning(&format!("skipped: {line}")));
                self.good.remove(number);
                self.skipped.push(line);
            }
            self.check(args)?;
        }
    }

    /// Numbers of the pairs whose blur is too large, in their order, and what to say of them.
    fn too_large(&self, config: &DatasetConfig) -> Result<BTreeMap<usize, String>, CommandError> {
        let named = |(number, (pair, _)): (usize, &(Pair, Depths))| {
            (pair.image.display().to_string(), number)
        };
        let numbers: BTreeMap<String, usize> = self.good.iter().enumerate().map(named).collect();
        let mut lines = BTreeMap::new();
        for index in 0..config.count {
            let index = u32::try_from(index).unwrap_or(u32::MAX);
            let recipe = recipes::recipe(config, index)?;
            let image = recipe.rgbd.as_ref().map_or("", |rgbd| &rgbd.image);
            let Some(&number) = numbers.get(image) else {
                continue;
            };
            let (pair, depths) = &self.good[number];
            if let Some(too_large) = depths.blurred_beyond(&recipe)? {
                let line = format!("{}: {too_large}", pair.image.display());
                lines.entry(number).or_insert(line);
            }
        }
        Ok(lines)
    }
}
