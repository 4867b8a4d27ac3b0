//! Where errors are counted: away from depth edges, and beside them.

use std::fmt;

use quadpixel::image::Image;
use quadpixel::render::truth::Defocus;
use quadpixel::render::{Camera, SubPixelImage};
use quadpixel::rgbd::DepthPicture;

/// Jump of the circle of confusion between neighbours that is an edge, px.
const JUMP_PX: f64 = 1.0;
/// Pixels around an edge that are beside it, and pixels beyond which the picture is away from every edge.
const BESIDE_PX: usize = 8;
const AWAY_PX: usize = 16;

pub struct Regions {
    pub width: usize,
    pub height: usize,
    pub away: Vec<bool>,
    known: Vec<bool>,
    beside: Vec<bool>,
    coc_px: [f64; 2],
}

impl Regions {
    pub fn new(camera: &Camera, picture: &DepthPicture, made_up: &Image) -> Self {
        let depth = picture.depth_mm();
        let (width, height) = (depth.width(), depth.height());
        let defocus = Defocus::new(camera).unwrap();
        let pitch = camera.sensor().pitch_mm();
        let coc = |d: &f32| defocus.circle_of_confusion_mm(f64::from(*d)) / pitch;
        let coc: Vec<f64> = depth.data().iter().map(coc).collect();
        let jumps = |i: usize, k: usize| (coc[i] - coc[k]).abs() > JUMP_PX;
        let is_edge = |i: usize| {
            let right = i % width + 1 < width && jumps(i, i + 1);
            right || i / width + 1 < height && jumps(i, i + width)
        };
        let edges: Vec<(usize, usize)> = (0..width * height)
            .filter(|i| is_edge(*i))
            .map(|i| (i % width, i / width))
            .collect();
        let within = |i: usize, px: usize| {
            let (x, y) = (i % width, i / width);
            let near = |e: &(usize, usize)| e.0.abs_diff(x) <= px && e.1.abs_diff(y) <= px;
            edges.iter().any(near)
        };
        // The picture's border is not judged: what is beyond it is made up in every way.
        let inner = |i: usize| {
            let (x, y) = (i % width, i / width);
            (AWAY_PX..width - AWAY_PX).contains(&x) && (AWAY_PX..height - AWAY_PX).contains(&y)
        };
        let share = |i: usize| made_up.data()[i];
        let all = 0..width * height;
        let beside: Vec<bool> = (all.clone())
            .map(|i| inner(i) && within(i, BESIDE_PX))
            .collect();
        let spread = |f: fn(f64, f64) -> f64| coc.iter().copied().reduce(f).unwrap();
        Self {
            width,
            height,
            away: (all.clone())
                .map(|i| inner(i) && share(i) < 1e-3 && !within(i, AWAY_PX))
                .collect(),
            known: all.map(|i| beside[i] && share(i) < 0.05).collect(),
            beside,
            coc_px: [spread(f64::min), spread(f64::max)],
        }
    }

    /// Root mean square differences over `white`: away, beside edges where little is made up, beside edges.
    pub fn rms(&self, a: &SubPixelImage, b: &SubPixelImage, white: f32) -> [f64; 3] {
        [&self.away, &self.known, &self.beside].map(|region| {
            let (mut sum, mut count) = (0.0, 0usize);
            for s in 0..a.subpixels.count() {
                let (a, b) = (a.view(s), b.view(s));
                for i in (0..region.len()).filter(|&i| region[i]) {
                    let (x, y) = (i % self.width, i / self.width);
                    for (a, b) in a.pixel(x, y).iter().zip(b.pixel(x, y)) {
                        sum += f64::from((a - b) / white).powi(2);
                        count += 1;
                    }
                }
            }
            (sum / count as f64).sqrt()
        })
    }

    /// Light of one over that of the other, all over but the border.
    pub fn energy(&self, a: &SubPixelImage, b: &SubPixelImage) -> f64 {
        let sum = |image: &SubPixelImage| -> f64 {
            let light = |s: usize| -> f64 {
                let view = image.view(s);
                let rows = AWAY_PX..self.height - AWAY_PX;
                let row = |y: usize| {
                    (AWAY_PX..self.width - AWAY_PX)
                        .flat_map(|x| view.pixel(x, y).iter().map(|v| f64::from(*v)))
                        .sum::<f64>()
                };
                rows.map(row).sum()
            };
            (0..image.subpixels.count()).map(light).sum()
        };
        sum(a) / sum(b)
    }
}

impl fmt::Display for Regions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share = |region: &[bool]| {
            100.0 * region.iter().filter(|r| **r).count() as f64 / region.len() as f64
        };
        write!(
            f,
            "circle of confusion {:.1} to {:.1} px; {:.0} % away, {:.0} % beside edges ({:.0} % known)",
            self.coc_px[0],
            self.coc_px[1],
            share(&self.away),
            share(&self.beside),
            share(&self.known)
        )
    }
}
