//! The paper's frame, reduced: a flat chart through the five-element phone lens, 32 rays per sub-pixel and channel,
//! rays per second. The whole frame has 3400 × 3400 sub-pixels (1700 × 1700 microlenses; the paper: about 12 hours on 6
//! cores, diffractive about 20 % slower than classic).
//!
//! Modes: classic (the ideal box), diffractive by the table of the centred lens (2D) and by that of all lens shifts
//! (4D), and bands of wavelengths in the place of one per channel; of sizes that pay for it, by maps of the lens.
//!
//! ```text
//! cargo bench --bench frame
//! QUADPIXEL_BENCH_SIDES=425,1700 cargo bench --bench frame -- frame/size     a quarter of the side, the whole frame
//! ```
#![allow(clippy::unwrap_used)] // because a bench on built-in data fails by panicking

#[path = "support/bench.rs"]
mod bench;
#[path = "support/frame.rs"]
mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use quadpixel::em::{Level, ModelChoice, Preset, ShiftGrid};
use quadpixel::render::{Camera, LensMaps};
use quadpixel::response::{GeometricResponse, Response, TableSettings};
use quadpixel::spectrum::{Bands, ChannelWavelengths};
use support::{Frame, RAYS_PER_SUBPIXEL, made_up_table};

/// Microlenses on a side.
const SIDE: usize = 48;

criterion_group!(name = benches; config = bench::short(); targets = modes, sizes, threads);
criterion_main!(benches);

/// Lens shifts per pitch of the table of all.
const PER_PITCH: usize = 16;

/// What the modes differ in: does a table have all lens shifts, and how many wavelengths has a channel's band (none:
/// one line).
fn table_camera(
    frame: &Frame,
    side: usize,
    all_shifts: bool,
    band_wavelengths: Option<usize>,
) -> Camera {
    let stack = &frame.stack;
    let wavelengths = band_wavelengths.map_or_else(ChannelWavelengths::default, |wavelengths| {
        let bands = Bands {
            wavelengths,
            ..Bands::default()
        };
        ChannelWavelengths::from_bands(bands).unwrap()
    });
    let nm = wavelengths.all_response_nm();
    let response = if all_shifts {
        let choice = ModelChoice::new(Level::Wave, Preset::Standard);
        let settings = TableSettings::for_all_shifts(&choice, stack, PER_PITCH);
        let grid = ShiftGrid::new(stack.pitch_um, PER_PITCH).unwrap();
        made_up_table(stack, &settings, nm, Some(grid))
    } else {
        let settings = TableSettings::new(Level::Wave, Preset::Standard, stack);
        made_up_table(stack, &settings, nm, None)
    };
    frame.camera(side, &response.unwrap(), wavelengths).unwrap()
}

fn classic_camera(frame: &Frame, side: usize) -> Camera {
    let stack = &frame.stack;
    let f_number = frame.lens.paraxial(550.0).unwrap().f_number;
    let focal_length_um = stack.pitch_um * f_number;
    let ideal = GeometricResponse::new(stack.subpixels, stack.pitch_um, focal_length_um).unwrap();
    let response = Response::Geometric(ideal);
    frame
        .camera(side, &response, ChannelWavelengths::default())
        .unwrap()
}

/// Rays of a shot: three channels.
fn rays(frame: &Frame, side: usize) -> Throughput {
    Throughput::Elements(
        (side * side * 3 * RAYS_PER_SUBPIXEL * frame.stack.subpixels.count()) as u64,
    )
}

fn modes(c: &mut Criterion) {
    let frame = Frame::new().unwrap();
    let mut group = c.benchmark_group("frame/mode");
    group.throughput(rays(&frame, SIDE));
    let camera = classic_camera(&frame, SIDE);
    group.bench_function("classic", |b| b.iter(|| frame.shot(&camera)));
    for (name, all_shifts, band_wavelengths) in [
        ("2D, lines", false, None),
        ("2D, bands of 1", false, Some(1)),
        ("2D, bands of 2", false, Some(2)),
        ("2D, bands of 4", false, Some(4)),
        ("2D, bands of 8", false, Some(8)),
        ("4D, lines", true, None),
        ("4D, bands of 2", true, Some(2)),
        ("4D, bands of 4", true, Some(4)),
    ] {
        let camera = table_camera(&frame, SIDE, all_shifts, band_wavelengths);
        group.bench_function(name, |b| b.iter(|| frame.shot(&camera)));
    }
}

fn sizes(c: &mut Criterion) {
    let frame = Frame::new().unwrap();
    let mut group = c.benchmark_group("frame/size");
    let given = std::env::var("QUADPIXEL_BENCH_SIDES");
    let sides = given.unwrap_or_else(|_| "24,48,192".into());
    for side in sides.split(',').map(|side| side.parse().unwrap()) {
        group.throughput(rays(&frame, side));
        let exact = table_camera(&frame, side, false, None);
        let mapped = frame.mapped(exact.clone());
        let mut cameras = vec![("classic", classic_camera(&frame, side)), ("2D", exact)];
        // Of few rays no map is made.
        if matches!(mapped.lens_maps(), LensMaps::Mapped { .. }) {
            cameras.push(("2D, lens maps", mapped));
        }
        for (name, camera) in cameras {
            let id = BenchmarkId::new(name, format!("{side}x{side}"));
            group.bench_function(id, |b| b.iter(|| frame.shot(&camera)));
        }
    }
}

fn threads(c: &mut Criterion) {
    let frame = Frame::new().unwrap();
    let camera = table_camera(&frame, SIDE, false, None);
    let mut group = c.benchmark_group("frame/threads");
    group.throughput(rays(&frame, SIDE));
    for threads in bench::thread_counts() {
        let pool = bench::pool(threads);
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| pool.install(|| frame.shot(&camera)));
        });
    }
}
