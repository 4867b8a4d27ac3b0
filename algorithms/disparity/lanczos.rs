//! Placeholder until the warp module lands.
pub(super) fn weights(f: f64) -> [f32; 8] {
    let mut w = [0.0f64; 8];
    let mut sum = 0.0;
    for (k, w) in w.iter_mut().enumerate() {
        let t = f - (k as f64 - 3.0);
        let s = |t: f64| {
            if t == 0.0 {
                1.0
            } else {
                (std::f64::consts::PI * t).sin() / (std::f64::consts::PI * t)
            }
        };
        *w = if t.abs() < 4.0 {
            s(t) * s(t / 4.0)
        } else {
            0.0
        };
        sum += *w;
    }
    w.map(|v| (v / sum) as f32)
}
