//! The numbers of a bank as an uncompressed `.npz` (NumPy: `np.load(path)`):
//!
//! | array | type | shape |
//! |---|---|---|
//! | `kernel` | f32 | [depth, field row, field column, channel, sub-pixel, y, x]: its light; sum 1 − `beyond` |
//! | `energy_sr` | f64 | [field row, field column, channel, sub-pixel]: what a white wall of radiance 1 gives, sr |
//! | `centroid_px` | f64 | [depth, field row, field column, channel, sub-pixel, 2]: (x right, y down) from the point |
//! | `beyond` | f64 | as `centroid_px`, without its last axis: part of the light that diffraction takes farther |
//! | `origin` | i64 | [2]: row and column of the point's own pixel in a kernel |
//! | `depth_m` | f64 | [depth]: z from the first lens vertex |
//! | `field_mm` | f64 | [field row, field column, 2]: place on the sensor |
//! | `meta` | u8 | UTF-8 JSON: `json.loads(bytes(f["meta"]))` |

use std::io::Cursor;
use std::path::Path;

use ndarray::{ArrayView, ArrayView1, IxDyn};
use ndarray_npy::{NpzWriter, WritableElement};
use quadpixel::render::kernels::{KernelBank, LaneFigures, Support};

use super::{Bank, BankError};

type Npz = NpzWriter<Cursor<Vec<u8>>>;

/// The numbers of a bank, row after row.
#[derive(Clone, Debug, PartialEq)]
pub struct BankArrays {
    /// [depth, field row, field column, channel, sub-pixel, y, x].
    pub shape: [usize; 7],
    /// Parts of each kernel's light, of that shape.
    pub kernel: Vec<f32>,
    /// What a white wall gives, sr: the shape from its second axis to its fifth.
    pub energy_sr: Vec<f64>,
    /// The shape's first five axes, then (x, y), px.
    pub centroid_px: Vec<f64>,
    /// Parts of the light beyond the kernels: the shape's first five axes.
    pub beyond: Vec<f64>,
    /// Row and column of the point's own pixel.
    pub origin: [i64; 2],
    /// The second and third axis, then (x, y), mm.
    pub field_mm: Vec<f64>,
}

impl BankArrays {
    /// Of a bank; `None` without a depth.
    pub fn new(kernels: &KernelBank) -> Option<Self> {
        let (nx, ny) = kernels.size();
        let (depths, channels) = (kernels.depths().len(), kernels.channels());
        let subpixels = kernels.subpixels().count();
        let support = kernels.support()?;
        let figures = |depth: usize| {
            let lanes = (0..nx * ny * channels * subpixels).map(move |k| {
                let (node, lane) = (k / (channels * subpixels), k % (channels * subpixels));
                (node, lane / subpixels, lane % subpixels)
            });
            lanes.map(move |(node, channel, s)| kernels.figures(depth, node, channel, s))
        };
        let all: Vec<LaneFigures> = (0..depths).flat_map(figures).collect();
        let size = (support.height, support.width);
        Some(Self {
            shape: [depths, ny, nx, channels, subpixels, size.0, size.1],
            kernel: planes(kernels, support),
            energy_sr: figures(0).map(|f| f.white_sr).collect(),
            centroid_px: all.iter().flat_map(|f| f.centroid_px.to_array()).collect(),
            beyond: all.iter().map(|f| f.beyond).collect(),
            origin: [-i64::from(support.top), -i64::from(support.left)],
            field_mm: (0..nx * ny)
                .flat_map(|node| kernels.node_mm(node).to_array())
                .collect(),
        })
    }
}

/// The bytes of the file; `path` names it in errors.
pub(super) fn npz(path: &Path, bank: &Bank<'_>) -> Result<Vec<u8>, BankError> {
    let failed = |why: String| BankError::Arrays {
        path: path.to_owned(),
        why,
    };
    let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
    fill(&mut npz, bank).map_err(failed)?;
    let bytes = npz.finish().map_err(|e| failed(e.to_string()))?;
    Ok(bytes.into_inner())
}

fn add<T: WritableElement>(
    npz: &mut Npz,
    name: &str,
    shape: &[usize],
    data: &[T],
) -> Result<(), String> {
    let array = ArrayView::from_shape(IxDyn(shape), data).map_err(|e| format!("{name}: {e}"))?;
    npz.add_array(name, &array)
        .map_err(|e| format!("{name}: {e}"))
}

fn fill(npz: &mut Npz, bank: &Bank<'_>) -> Result<(), String> {
    let arrays = BankArrays::new(bank.kernels).ok_or("no depth")?;
    let whole = &arrays.shape[..5];
    add(npz, "kernel", &arrays.shape, &arrays.kernel)?;
    add(npz, "energy_sr", &whole[1..], &arrays.energy_sr)?;
    add(
        npz,
        "centroid_px",
        &[whole, &[2]].concat(),
        &arrays.centroid_px,
    )?;
    add(npz, "beyond", whole, &arrays.beyond)?;
    add(npz, "origin", &[2], &arrays.origin)?;
    add(npz, "depth_m", &[whole[0]], bank.depths_m)?;
    add(npz, "field_mm", &[whole[1], whole[2], 2], &arrays.field_mm)?;
    let meta = serde_json::to_vec(&bank.about).map_err(|e| format!("meta: {e}"))?;
    npz.add_array("meta", &ArrayView1::from(&meta))
        .map_err(|e| format!("meta: {e}"))
}

/// `[depth][node][channel][sub-pixel][y][x]` on one support.
fn planes(kernels: &KernelBank, support: Support) -> Vec<f32> {
    let (nx, ny) = kernels.size();
    let count = kernels.channels() * kernels.subpixels().count();
    let plane = support.width * support.height;
    let mut planes = vec![0.0; kernels.depths().len() * nx * ny * count * plane];
    let mut targets = planes.chunks_exact_mut(count * plane);
    for depth in kernels.depths() {
        let own = depth.support();
        let (dx, dy) = (
            (own.left - support.left) as usize,
            (own.top - support.top) as usize,
        );
        for node in 0..nx * ny {
            let Some(target) = targets.next() else { break };
            let kept: Vec<f32> = (depth.beyond(node).iter())
                .map(|beyond| (1.0 - beyond) as f32)
                .collect();
            for (i, pixel) in depth
                .of_node(node)
                .chunks_exact(kernels.lanes())
                .enumerate()
            {
                let (x, y) = (i % own.width + dx, i / own.width + dy);
                for (lane, value) in pixel.iter().take(count).enumerate() {
                    target[lane * plane + y * support.width + x] = value * kept[lane];
                }
            }
        }
    }
    planes
}
