//! Samples on their way: while one is rendered, the last one is written and the next one is put together, so that no
//! thread waits for what only one of them has work for.

use std::path::Path;

use crate::assemble::Responses;
use crate::observer::{Event, Observer};
use crate::production::dataset::Summary;
use crate::production::error::GenerateError;
use crate::production::run_folder::RunFolder;
use crate::recipe::{Recipe, SampleId};
use crate::sample::stages::{Stages, timed};
use crate::sample::{Prepared, Rays, Sample, SampleError, prepare};
use crate::writer::{EarlierSample, Place, WriteError, earlier_sample, write_sample};

/// Three samples at a time, each a step ahead of the other.
pub(super) struct Line<'a> {
    writer: &'a Writer<'a>,
    responses: Responses,
    /// To be rendered, and its number.
    prepared: Option<(Prepared, u32)>,
    /// To be written.
    rendered: Option<Sample>,
}

impl<'a> Line<'a> {
    pub fn new(writer: &'a Writer<'a>) -> Self {
        Self {
            writer,
            responses: Responses::new(),
            prepared: None,
            rendered: None,
        }
    }

    /// Every sample goes on by a step, and the `next` one comes in. A large one is rendered and written alone: it may
    /// take what memory there is.
    ///
    /// # Errors
    /// A sample that cannot be made; those before it are written first.
    pub fn advance(
        &mut self,
        next: Option<(&Recipe, u32)>,
        done: &mut Summary,
    ) -> Result<(), GenerateError> {
        let (writer, responses) = (self.writer, &mut self.responses);
        let (current, last) = (self.prepared.take(), self.rendered.take());
        let is_large = current.as_ref().is_some_and(|(p, _)| p.is_large());
        let render = || current.map(|(prepared, index)| writer.render(prepared, index));
        let write = || last.map(|sample| writer.write(&sample));
        let mut prepare = || {
            next.map(|(recipe, index)| {
                let prepared = writer.prepare((recipe, index), responses);
                prepared.map(|prepared| (prepared, index))
            })
        };
        let both = || rayon::join(render, write);
        let ((rendered, written), prepared) = match is_large {
            true => (both(), None),
            false => rayon::join(both, &mut prepare),
        };
        if let Some(stages) = written {
            done.add(stages?);
        }
        match rendered.transpose()? {
            Some(Rendered::Whole(sample)) => self.rendered = Some(*sample),
            Some(Rendered::Written(stages)) => done.add(stages),
            None => (),
        }
        match prepared.or_else(prepare).transpose() {
            Ok(prepared) => self.prepared = prepared,
            Err(cause) => {
                self.end(done)?;
                return Err(cause);
            }
        }
        Ok(())
    }

    /// Renders and writes what is left; where the run is to stop, what is rendered alone is written.
    ///
    /// # Errors
    /// As of [`Self::advance`].
    pub fn end(&mut self, done: &mut Summary) -> Result<(), GenerateError> {
        if self.writer.observer.stop_asked() {
            self.prepared = None;
        }
        while self.prepared.is_some() || self.rendered.is_some() {
            self.advance(None, done)?;
        }
        Ok(())
    }
}

/// Where the samples of a part go.
pub(super) struct Writer<'a> {
    pub folder: RunFolder,
    /// Hash of the configuration.
    pub hash: String,
    pub observer: &'a dyn Observer,
}

impl Writer<'_> {
    /// Whether an earlier run finished a sample below `root`; what is broken is reported and taken away.
    pub fn has(&self, root: &Path, index: u32) -> Result<bool, WriteError> {
        match earlier_sample(root, index, &self.hash)? {
            EarlierSample::Whole => Ok(true),
            EarlierSample::Nothing => Ok(false),
            EarlierSample::Broken(what) => {
                let text = format!("sample {index} was damaged ({what}); it is made again");
                self.observer.event(Event::Warning(&text));
                Ok(false)
            }
        }
    }

    /// Puts a sample together.
    fn prepare(
        &self,
        (recipe, index): (&Recipe, u32),
        responses: &mut Responses,
    ) -> Result<Prepared, GenerateError> {
        let prepared = prepare(recipe, responses, self.observer);
        let prepared = prepared.map_err(|e| failed(index, e.into()))?;
        for warning in responses.take_warnings() {
            self.observer.event(Event::Warning(&warning));
        }
        Ok(prepared)
    }

    /// Renders a sample; one of a large picture is written with it.
    fn render(&self, prepared: Prepared, index: u32) -> Result<Rendered, GenerateError> {
        let id = SampleId {
            index,
            configuration_blake3: self.hash.clone(),
        };
        let name = format!("sample {index}");
        if prepared.is_large() {
            self.folder.still_there()?;
            let rows = prepared.by_rows(id).map_err(|e| failed(index, e))?;
            let made = rows.write(Place::Dataset(self.folder.path()), self.observer)?;
            made.report(self.observer, &name);
            self.tell(index, made.stages);
            return Ok(Rendered::Written(made.stages));
        }
        let rendered = prepared.render(id, Rays::Trace, self.observer);
        let (sample, _) = rendered.map_err(|e| failed(index, e))?;
        sample.made.report(self.observer, &name);
        Ok(Rendered::Whole(Box::new(sample)))
    }

    /// Writes a sample. Where the time went.
    fn write(&self, sample: &Sample) -> Result<Stages, GenerateError> {
        self.folder.still_there()?;
        let mut stages = sample.made.stages;
        timed(&mut stages.writing_s, || {
            write_sample(self.folder.path(), &sample.files())
        })?;
        self.tell(sample.made.description.index, stages);
        Ok(stages)
    }

    /// Tells that a sample is done.
    fn tell(&self, index: u32, stages: Stages) {
        let detail = format!("sample {index}: {stages}");
        self.observer.event(Event::Detail(&detail));
        self.observer.event(Event::SampleDone);
    }
}

/// A sample that was rendered.
enum Rendered {
    /// It is to be written.
    Whole(Box<Sample>),
    /// It is written; where the time went.
    Written(Stages),
}

fn failed(index: u32, cause: SampleError) -> GenerateError {
    GenerateError::Sample {
        index,
        cause: Box::new(cause),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::config::DatasetConfig;
    use crate::production::dataset::make;

    const CONFIG: &str = r#"
count = 3
seed = 5
rays_per_pixel = 4
exposure_ev = 0
[lens]
names = ["lib_triplet_US2453260"]
focus_mm = { min = 800, max = 1600 }
[sensor]
subpixels = "2x2"
width = 32
height = 24
window = { at = "random", max_height_mm = 1.0 }
microlens_shift = { rule = "chief-ray" }
pitch_um = 2.0
[response]
model = "geometric"
[scene]
charts = ["noise"]
background_over_focus = 1.5
tilt_deg = { min = -10, max = 10 }
cards = 1
card_over_focus = 0.7
card_size = 0.4
texture_px = 32
"#;

    /// Asks for an end once the first sample is written.
    #[derive(Default)]
    struct First(AtomicUsize);

    impl Observer for First {
        fn event(&self, event: Event<'_>) {
            if matches!(event, Event::SampleDone) {
                self.0.fetch_add(1, Ordering::SeqCst);
            }
        }

        fn stop_asked(&self) -> bool {
            self.0.load(Ordering::SeqCst) > 0
        }
    }

    #[test]
    fn a_run_that_is_to_stop_writes_what_is_rendered_and_renders_no_more() {
        let folder = tempfile::tempdir().unwrap();
        let config = DatasetConfig::from_toml(CONFIG, "t").unwrap();
        let (out, first) = (folder.path().join("out"), First::default());
        // The first is written while the second is rendered and the third, the last, put together.
        let stopped = make(&config, &out, &first).unwrap_err();
        let [done, samples] = match stopped {
            GenerateError::Stopped { done, samples } => [done, samples],
            other => panic!("{other}"),
        };
        assert_eq!([done, samples], [2, 3]);
        assert_eq!(make(&config, &out, &()).unwrap().reused, 2);
    }
}
