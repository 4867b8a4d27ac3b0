//! The GGX microfacet surface, in a frame whose z is the normal.
//!
//! ```text
//! f = F D G₂ / (4 cos θ_o cos θ_i)       D = α² / (π (h_x² + h_y² + α² h_z²)²)
//! G₁ = 1/(1 + Λ),   G₂ = 1/(1 + Λ_o + Λ_i),   Λ = (√(1 + α² tan²θ) − 1)/2
//! F = F₀ + (F₉₀ − F₀)(1 − h·o)⁵
//! ```
//!
//! B. Walter et al., EGSR 2007; E. Heitz, JCGT 3(2) (2014) (Smith's masking, height-correlated); normals that are seen
//! are drawn by J. Dupuy, A. Benyoub, CGF 42(8) (2023). Light that bounces between facets is lost, as in most
//! renderers: a rough white metal absorbs up to 0.5.

use std::sync::LazyLock;

use glam::Vec3A as Vec3;

/// A width α of the distribution of normals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx {
    alpha: f32,
}

impl Ggx {
    /// The width is the square of glTF's roughness.
    pub fn new(roughness: f32) -> Self {
        Self {
            alpha: roughness * roughness,
        }
    }

    fn d(&self, h: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        let s = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
        a2 / (std::f32::consts::PI * s * s)
    }

    fn lambda(&self, w: Vec3) -> f32 {
        let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
        0.5 * ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0)
    }

    /// D G₂ / (4 cos θ_o) for reflection from `i` to `o`, both above: f · cos θ_i without F.
    pub fn reflected(&self, o: Vec3, i: Vec3, h: Vec3) -> f32 {
        self.d(h) / (4.0 * o.z * (1.0 + self.lambda(o) + self.lambda(i)))
    }

    /// Density, per solid angle of the reflected direction, of drawing the normal `h` by [`Self::sample_normal`].
    pub fn density(&self, o: Vec3, h: Vec3) -> f32 {
        self.d(h) / (4.0 * o.z * (1.0 + self.lambda(o)))
    }

    /// G₂/G₁: what a drawn reflection weighs, without F.
    pub fn weight(&self, o: Vec3, i: Vec3) -> f32 {
        let (lo, li) = (self.lambda(o), self.lambda(i));
        (1.0 + lo) / (1.0 + lo + li)
    }

    /// A normal in proportion to how much of it is seen from `o`, above.
    pub fn sample_normal(&self, o: Vec3, [s, t]: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(o.x * self.alpha, o.y * self.alpha, o.z).normalize();
        let (sin, cos) = (std::f32::consts::TAU * s).sin_cos();
        let z = (1.0 - t) * (1.0 + stretched.z) - stretched.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let h = Vec3::new(r * cos, r * sin, z) + stretched;
        Vec3::new(h.x * self.alpha, h.y * self.alpha, h.z.max(1e-7)).normalize()
    }
}

/// (1 − c)⁵.
#[inline]
pub(super) fn schlick(c: f32) -> f32 {
    let x = (1.0 - c).clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

/// Reflectance of a smooth surface between dielectrics, the mean of both polarizations; `eta` is the index beyond it
/// divided by that on the ray's side, `cos` ≥ 0 the ray's. Also the cosine beyond, 0 for total reflection.
pub(super) fn fresnel(cos: f32, eta: f32) -> (f32, f32) {
    let sin2 = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if sin2 >= 1.0 {
        return (1.0, 0.0);
    }
    let beyond = (1.0 - sin2).sqrt();
    let s = (cos - eta * beyond) / (cos + eta * beyond);
    let p = (eta * cos - beyond) / (eta * cos + beyond);
    (0.5 * (s * s + p * p), beyond)
}

/// How much a GGX surface reflects of light from one direction, E(cos θ, roughness) = F₀ (a − b) + F₉₀ b, with a the
/// integral of f cos θ_i for F = 1 and b that for F = (1 − h·o)⁵; and its mean over a cosine-weighted hemisphere.
#[derive(Clone, Debug)]
pub(super) struct AlbedoTable {
    /// (a, b), `COSINES` of them a roughness, at cos θ = k/(COSINES − 1).
    entries: Vec<[f32; 2]>,
    /// 2 ∫ (a, b) cos θ d(cos θ), one a roughness.
    means: Vec<[f32; 2]>,
}

/// Columns of an [`AlbedoTable`].
const COSINES: usize = 64;
/// Rows of an [`AlbedoTable`], roughness from 0 to 1.
const ROUGHNESSES: usize = 33;

impl AlbedoTable {
    /// The one table there is, made when it is first asked for: half a million samples, as long as a small picture
    /// takes.
    pub fn shared() -> &'static Self {
        static TABLE: LazyLock<AlbedoTable> = LazyLock::new(AlbedoTable::new);
        &TABLE
    }

    fn new() -> Self {
        const SIDE: usize = 16;
        let mut entries = Vec::with_capacity(COSINES * ROUGHNESSES);
        for row in 0..ROUGHNESSES {
            let ggx = Ggx::new(row as f32 / (ROUGHNESSES - 1) as f32);
            for column in 0..COSINES {
                let cos = (column as f32 / (COSINES - 1) as f32).max(1e-3);
                let o = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
                let mut sums = [0.0f32; 2];
                for k in 0..SIDE * SIDE {
                    let u = [k % SIDE, k / SIDE].map(|i| (i as f32 + 0.5) / SIDE as f32);
                    // A mirror's only normal, without 0/0.
                    let h = if row == 0 {
                        Vec3::Z
                    } else {
                        ggx.sample_normal(o, u)
                    };
                    let c = o.dot(h).clamp(0.0, 1.0);
                    let i = 2.0 * c * h - o;
                    if i.z > 0.0 {
                        let weight = ggx.weight(o, i);
                        sums[0] += weight;
                        sums[1] += weight * schlick(c);
                    }
                }
                entries.push(sums.map(|s| s / (SIDE * SIDE) as f32));
            }
        }
        let means = entries
            .chunks_exact(COSINES)
            .map(|row| {
                // The exact integral of the linear interpolation times the cosine.
                let d = 1.0 / (COSINES - 1) as f32;
                let mut sum = [0.0f32; 2];
                for (k, pair) in row.windows(2).enumerate() {
                    let x = k as f32 * d;
                    for (s, (p, q)) in sum.iter_mut().zip(pair[0].iter().zip(pair[1])) {
                        *s += d * (x * 0.5 * (p + q) + d * (p / 6.0 + q / 3.0));
                    }
                }
                sum.map(|s| 2.0 * s)
            })
            .collect();
        Self { entries, means }
    }

    /// E for these F₀ and F₉₀.
    pub fn reflectance(&self, cos: f32, roughness: f32, f0: Vec3, f90: f32) -> Vec3 {
        let x = cos.clamp(0.0, 1.0) * (COSINES - 1) as f32;
        let i = (x as usize).min(COSINES - 2);
        let (row, fy) = row_of(roughness);
        let at = |row: usize| {
            let k = row * COSINES + i;
            mix(self.entries[k], self.entries[k + 1], x - i as f32)
        };
        combine(mix(at(row), at(row + 1), fy), f0, f90)
    }

    /// Mean of E over a cosine-weighted hemisphere.
    pub fn mean(&self, roughness: f32, f0: Vec3, f90: f32) -> Vec3 {
        let (row, fy) = row_of(roughness);
        combine(mix(self.means[row], self.means[row + 1], fy), f0, f90)
    }
}

fn row_of(roughness: f32) -> (usize, f32) {
    let y = roughness.clamp(0.0, 1.0) * (ROUGHNESSES - 1) as f32;
    let row = (y as usize).min(ROUGHNESSES - 2);
    (row, y - row as f32)
}

fn mix(a: [f32; 2], b: [f32; 2], f: f32) -> [f32; 2] {
    [a[0] + (b[0] - a[0]) * f, a[1] + (b[1] - a[1]) * f]
}

fn combine([a, b]: [f32; 2], f0: Vec3, f90: f32) -> Vec3 {
    f0 * (a - b) + Vec3::splat(f90 * b)
}
