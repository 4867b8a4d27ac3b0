//! A trained network: the roots of two views in, and what matching found of them; disparity and its spread out.

use std::io::{Cursor, Read};
use std::sync::Arc;

use quadpixel::image::Image;
use rten::{Model, ModelOptions, NodeId, RunOptions, ThreadPool, Value, op_registry};
use rten_tensor::prelude::*;
use rten_tensor::{NdTensor, NdTensorView};

use super::filters::{by_rows, row_of};

/// The network that learn/README.md describes.
const SHIPPED: &[u8] = include_bytes!("network.zip");
/// Name of the graph within its archive.
const ENTRY: &str = "network.onnx";
/// Most bytes of a graph.
const MOST_BYTES: u64 = 64 << 20;
/// The network halves the resolution six times.
const MULTIPLE_PX: usize = 64;

/// A graph that tells the disparity of two views.
pub struct Network {
    model: Model,
    views: NodeId,
    /// Where it takes what matching found, if it does.
    matched: Option<NodeId>,
    output: NodeId,
}

/// What a network cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NetworkError {
    /// Not an archive with a graph.
    #[error(
        "no network: a zip archive with {ENTRY} is expected, as learn/export.py writes it ({0})"
    )]
    Archive(String),
    /// A graph that is none, or has operators that are not known here.
    #[error("{ENTRY} cannot be used: {0}")]
    Graph(String),
    /// A graph of another task.
    #[error(
        "{ENTRY} does not fit: it must take views (1, 2, H, W), and may take what matching found of them \
         (1, 2, H/2, W/2); it must give (1, 2, H/2, W/2) numbers ({0})"
    )]
    Shape(String),
}

/// Disparity in px and the logarithm of its spread, at every second pixel: of matching, its σ; of the network, the mean
/// absolute error to expect.
pub(super) struct Told {
    pub disparity: Image,
    pub log_spread: Image,
}

impl Network {
    /// The one that comes with the program.
    ///
    /// # Errors
    /// None is expected: tests load it.
    pub fn shipped() -> Result<Self, NetworkError> {
        Self::from_archive(SHIPPED)
    }

    /// Of the bytes of an archive that `learn/export.py` wrote.
    ///
    /// # Errors
    /// No such archive; a graph that cannot be run, or takes or gives something else.
    pub fn from_archive(bytes: &[u8]) -> Result<Self, NetworkError> {
        let graph = graph_of(bytes).map_err(NetworkError::Archive)?;
        let operators = op_registry!(
            Add,
            AveragePool,
            Cast,
            Concat,
            Conv,
            Div,
            Log,
            Mul,
            Relu,
            Reshape,
            Resize,
            Shape,
            Sigmoid,
            Slice,
            Sqrt,
            Squeeze,
            Sub,
            Transpose,
            Unsqueeze
        );
        let model = (ModelOptions::with_ops(operators).load(graph))
            .map_err(|e| NetworkError::Graph(e.to_string()))?;
        let (views, matched, output) = match (model.input_ids(), model.output_ids()) {
            (&[views], &[output]) => (views, None, output),
            (&[views, matched], &[output]) => (views, Some(matched), output),
            (inputs, outputs) => {
                let count = [inputs.len(), outputs.len()];
                return Err(NetworkError::Shape(format!(
                    "{} inputs and {} outputs",
                    count[0], count[1]
                )));
            }
        };
        let network = Self {
            model,
            views,
            matched,
            output,
        };
        let flat = |side| Image::zeros(side, side, 1);
        let (views, [disparity, log_spread]) = (
            [flat(MULTIPLE_PX), flat(MULTIPLE_PX)],
            [flat(MULTIPLE_PX / 2), flat(MULTIPLE_PX / 2)],
        );
        let found = Told {
            disparity,
            log_spread,
        };
        network.told(views.each_ref(), &found)?;
        Ok(network)
    }

    /// Whether it builds on what matching found.
    pub fn takes_matched(&self) -> bool {
        self.matched.is_some()
    }

    /// Of the roots of two views of one size, whose common 99th percentile is 1, and of what matching found of them.
    pub(super) fn told(&self, views: [&Image; 2], matched: &Told) -> Result<Told, NetworkError> {
        let (width, height) = (views[0].width(), views[0].height());
        let [wide, high] = [width, height].map(|n| n.next_multiple_of(MULTIPLE_PX));
        let views = planes(views, [wide, high]);
        let matched = planes(
            [&matched.disparity, &matched.log_spread],
            [wide / 2, high / 2],
        );
        let mut inputs = vec![(self.views, views.view().into())];
        inputs.extend(self.matched.map(|id| (id, matched.view().into())));
        let threads = ThreadPool::with_num_threads(rayon::current_num_threads());
        let options = RunOptions::default().with_thread_pool(Some(Arc::new(threads)));
        let found = self.model.run(inputs, &[self.output], Some(options));
        let found = found.map_err(|e| NetworkError::Shape(e.to_string()))?;
        let Some(Value::FloatTensor(found)) = found.into_iter().next() else {
            return Err(NetworkError::Shape("no floats come out".to_owned()));
        };
        let wanted = [1, 2, high / 2, wide / 2];
        let shape = found.shape().to_vec();
        if shape != wanted || found.iter().any(|v| !v.is_finite()) {
            let text = format!("{shape:?} of {:?} or not finite", views.shape());
            return Err(NetworkError::Shape(text));
        }
        let found: NdTensorView<'_, f32, 4> = found.nd_view();
        let plane = |c: usize| {
            by_rows(width.div_ceil(2), height.div_ceil(2), |y, to| {
                let row = to.iter_mut().enumerate();
                row.for_each(|(x, to)| *to = found[[0, c, y, x]]);
            })
        };
        Ok(Told {
            disparity: plane(0),
            log_spread: plane(1),
        })
    }
}

/// (1, 2, height, width), the last pixels repeated.
fn planes(images: [&Image; 2], [width, height]: [usize; 2]) -> NdTensor<f32, 4> {
    let mut values = Vec::with_capacity(2 * width * height);
    for image in images {
        for y in 0..height {
            let row = row_of(image, y.min(image.height() - 1));
            values.extend_from_slice(row);
            values.extend(std::iter::repeat_n(row[row.len() - 1], width - row.len()));
        }
    }
    NdTensor::from_data([1, 2, height, width], values)
}

fn graph_of(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| e.to_string())?;
    let entry = archive.by_name(ENTRY).map_err(|e| e.to_string())?;
    let mut graph = Vec::new();
    let read = entry.take(MOST_BYTES + 1).read_to_end(&mut graph);
    match read.map_err(|e| e.to_string())? as u64 {
        size if size > MOST_BYTES => Err(format!("more than {} MiB", MOST_BYTES >> 20)),
        _ => Ok(graph),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use std::io::Write;

    use super::*;

    fn archive(name: &str, content: &[u8]) -> Vec<u8> {
        let mut file = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let options = zip::write::SimpleFileOptions::default();
        file.start_file(name, options).unwrap();
        file.write_all(content).unwrap();
        file.finish().unwrap().into_inner()
    }

    fn refusal(bytes: &[u8]) -> NetworkError {
        match Network::from_archive(bytes) {
            Err(error) => error,
            Ok(_) => panic!("it was taken"),
        }
    }

    #[test]
    fn what_is_no_network_is_refused() {
        for bytes in [
            &b""[..],
            b"no archive",
            &archive("other.onnx", b""),
            &SHIPPED[..SHIPPED.len() / 2],
        ] {
            assert!(matches!(refusal(bytes), NetworkError::Archive(_)));
        }
        for graph in [&b"no graph"[..], &[0x08, 0x07]] {
            let found = refusal(&archive(ENTRY, graph));
            assert!(!matches!(found, NetworkError::Archive(_)), "{found}");
        }
    }

    #[test]
    fn a_size_that_is_no_multiple_keeps_its_pixels() {
        let network = Network::shipped().unwrap();
        let view = by_rows(83, 70, |y, to| {
            let row = to.iter_mut().enumerate();
            row.for_each(|(x, to)| *to = 0.5 + 0.2 * (0.9 * x as f32 + 0.4 * y as f32).sin());
        });
        let none = Told {
            disparity: Image::zeros(42, 35, 1),
            log_spread: Image::zeros(42, 35, 1),
        };
        let found = network.told([&view, &view], &none).unwrap();
        assert_eq!(
            (found.disparity.width(), found.disparity.height()),
            (42, 35)
        );
        let largest = (found.disparity.data().iter()).fold(0.0f32, |m, v| m.max(v.abs()));
        assert!(largest < 0.3, "copies have no disparity: {largest}");
    }
}
