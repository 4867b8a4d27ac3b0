//! Where a block of rays crosses a card's plane, and which of them meet the card before what they met so far.
//!
//! Straight-line arithmetic, in one order at every SIMD level: the level changes the speed only.

use crate::scene::plane::Solver;
use crate::simd::SimdLevel;

/// Rays whose crossings with a card's plane are found together.
pub(crate) const BLOCK: usize = 128;

/// From where each ray of a block crosses a card's plane, in s and t.
pub(crate) struct Ways {
    /// To where the card must be for it to be met.
    pub to_card: [[f32; BLOCK]; 2],
    /// To where it is said to be met.
    pub to_place: [[f32; BLOCK]; 2],
}

impl Ways {
    pub(super) const NONE: Self = Self {
        to_card: [[0.0; BLOCK]; 2],
        to_place: [[0.0; BLOCK]; 2],
    };
}

/// What a block of rays has to do with a card's plane.
pub(super) struct Crossings {
    /// Distance along each ray.
    tau: [f64; BLOCK],
    s: [f64; BLOCK],
    t: [f64; BLOCK],
    /// Not 0: it meets the card.
    met: [u64; BLOCK],
}

/// Compiles a function for each SIMD level, and calls the one that this CPU has.
macro_rules! by_simd_level {
    ($name:ident($($arg:ident: $of:ty),*) $(-> $out:ty)?, $body:path) => {
        fn $name($($arg: $of),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2($($arg: $of),*) $(-> $out)? {
                $body($($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512dq,avx512vl")]
            fn avx512($($arg: $of),*) $(-> $out)? {
                $body($($arg),*)
            }
            match SimdLevel::detect() {
                #[cfg(target_arch = "x86_64")]
                // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
                SimdLevel::Avx512 => unsafe { avx512($($arg),*) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: `detect` found AVX2 on this CPU.
                SimdLevel::Avx2 => unsafe { avx2($($arg),*) },
                _ => $body($($arg),*),
            }
        }
    };
}

impl Crossings {
    pub const NONE: Self = Self {
        tau: [0.0; BLOCK],
        s: [0.0; BLOCK],
        t: [0.0; BLOCK],
        met: [0; BLOCK],
    };

    /// Of rays by their origins and directions. Whether any comes as near to the card as `reach`, in s and t.
    pub fn find(&mut self, plane: &Solver, rays: [[&[f64]; 3]; 2], reach: f64) -> bool {
        find(self, plane, rays, reach)
    }

    /// Finds out which rays, going these ways, meet the card before these distances.
    pub fn choose(&mut self, ways: &Ways, distance_mm: &[f64]) {
        choose(self, ways, distance_mm);
    }

    /// Leaves out those of the first `n` rays that meet the card where it `is_open`.
    pub fn leave_out(&mut self, ways: &Ways, n: usize, is_open: impl Fn(f32, f32) -> bool) {
        let [to_s, to_t] = &ways.to_card;
        for i in 0..n.min(BLOCK) {
            let at = |x: f64, way: f32| (x + f64::from(way)) as f32;
            if self.met[i] != 0 && is_open(at(self.s[i], to_s[i]), at(self.t[i], to_t[i])) {
                self.met[i] = 0;
            }
        }
    }

    /// Writes down the rays that meet the card, whose number is `index`.
    pub fn take(
        &self,
        index: u16,
        ways: &Ways,
        distance_mm: &mut [f64],
        surface: &mut [u16],
        places: [&mut [f32]; 2],
    ) {
        take(self, index, ways, distance_mm, surface, places);
    }
}

by_simd_level!(
    find(met: &mut Crossings, plane: &Solver, rays: [[&[f64]; 3]; 2], reach: f64) -> bool,
    find_plainly
);

#[inline(always)]
fn find_plainly(
    met: &mut Crossings,
    plane: &Solver,
    [origins, directions]: [[&[f64]; 3]; 2],
    reach: f64,
) -> bool {
    let n = origins[0].len().min(BLOCK);
    let [ox, oy, oz] = origins.map(|a| &a[..n]);
    let [dx, dy, dz] = directions.map(|a| &a[..n]);
    let (taus, ss, ts) = (&mut met.tau[..n], &mut met.s[..n], &mut met.t[..n]);
    let mut any = 0;
    for i in 0..n {
        let (o, d) = (
            glam::DVec3::new(ox[i], oy[i], oz[i]),
            glam::DVec3::new(dx[i], dy[i], dz[i]),
        );
        let tau = (plane.offset - plane.normal.dot(o)) / plane.normal.dot(d);
        let p = o + tau * d;
        let s = plane.s_axis.dot(p) + plane.s0;
        let t = plane.t_axis.dot(p) + plane.t0;
        let near = |x: f64| (-reach..=1.0 + reach).contains(&x);
        (taus[i], ss[i], ts[i]) = (tau, s, t);
        any |= u64::from((tau > 0.0) & near(s) & near(t));
    }
    any != 0
}

by_simd_level!(choose(met: &mut Crossings, ways: &Ways, distance_mm: &[f64]), choose_plainly);

#[inline(always)]
fn choose_plainly(met: &mut Crossings, ways: &Ways, distance_mm: &[f64]) {
    let n = distance_mm.len().min(BLOCK);
    let (taus, ss, ts) = (&met.tau[..n], &met.s[..n], &met.t[..n]);
    let (to_s, to_t) = (&ways.to_card[0][..n], &ways.to_card[1][..n]);
    let (mets, distance_mm) = (&mut met.met[..n], &distance_mm[..n]);
    for i in 0..n {
        let (s, t) = (ss[i] + f64::from(to_s[i]), ts[i] + f64::from(to_t[i]));
        // Written so that NaN (a lost ray, or one along the plane) is no hit.
        let within = |x: f64| (0.0..=1.0).contains(&x);
        let is_met = (taus[i] > 0.0) & (taus[i] < distance_mm[i]) & within(s) & within(t);
        mets[i] = u64::from(is_met);
    }
}

by_simd_level!(
    take(
        met: &Crossings,
        index: u16,
        ways: &Ways,
        distance_mm: &mut [f64],
        surface: &mut [u16],
        places: [&mut [f32]; 2]
    ),
    take_plainly
);

#[inline(always)]
fn take_plainly(
    met: &Crossings,
    index: u16,
    ways: &Ways,
    distance_mm: &mut [f64],
    surface: &mut [u16],
    [s, t]: [&mut [f32]; 2],
) {
    let n = distance_mm.len().min(BLOCK);
    let (mets, taus, ss, ts) = (&met.met[..n], &met.tau[..n], &met.s[..n], &met.t[..n]);
    let (to_s, to_t) = (&ways.to_place[0][..n], &ways.to_place[1][..n]);
    let (distance_mm, surface) = (&mut distance_mm[..n], &mut surface[..n]);
    let (s, t) = (&mut s[..n], &mut t[..n]);
    for i in 0..n {
        let is_met = mets[i] != 0;
        let place_s = (ss[i] + f64::from(to_s[i])) as f32;
        let place_t = (ts[i] + f64::from(to_t[i])) as f32;
        distance_mm[i] = if is_met { taus[i] } else { distance_mm[i] };
        surface[i] = if is_met { index } else { surface[i] };
        s[i] = if is_met { place_s } else { s[i] };
        t[i] = if is_met { place_t } else { t[i] };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn lanes_change_no_bit() {
        let plane = Solver {
            normal: DVec3::new(0.1, -0.2, 0.9),
            offset: -120.0,
            s_axis: DVec3::new(0.011, 0.001, 0.0),
            s0: 0.5,
            t_axis: DVec3::new(0.002, -0.013, 0.001),
            t0: 0.6,
        };
        let column = |k: usize| -> Vec<f64> {
            let value = |i: usize| ((i * 7 + k * 3) as f64 * 0.61).sin();
            (0..BLOCK - 3).map(value).collect()
        };
        let [ox, oy, oz, dx, dy] = [0, 1, 2, 3, 4].map(column);
        // Some rays go away from the plane.
        let dz: Vec<f64> = column(5).iter().map(|z| 3.0 * z - 2.0).collect();
        let rays = [[&ox[..], &oy, &oz], [&dx, &dy, &dz]];
        let far: Vec<f64> = column(6).iter().map(|x| 150.0 * (1.0 + x)).collect();
        let mut ways = Ways::NONE;
        let way = |k: usize| std::array::from_fn(|i| 0.1 * ((i * 5 + k) as f32).cos());
        (ways.to_card, ways.to_place) = ([way(0), way(1)], [way(2), way(3)]);
        let run = |plainly: bool| {
            let mut met = Crossings::NONE;
            let (mut distance, mut surface) = (far.clone(), vec![9; far.len()]);
            let mut places = [(); 2].map(|()| vec![0.0; far.len()]);
            let [s, t] = places.each_mut().map(|x| &mut x[..]);
            if plainly {
                assert!(find_plainly(&mut met, &plane, rays, 0.1));
                choose_plainly(&mut met, &ways, &distance);
                take_plainly(&met, 4, &ways, &mut distance, &mut surface, [s, t]);
            } else {
                assert!(met.find(&plane, rays, 0.1));
                met.choose(&ways, &distance);
                met.take(4, &ways, &mut distance, &mut surface, [s, t]);
            }
            (distance, surface, places)
        };
        let plain = run(true);
        assert_eq!(run(false), plain);
        let met = plain.1.iter().filter(|surface| **surface == 4).count();
        assert!((10..far.len() - 10).contains(&met), "{met} met");
    }
}
