//! Which instructions a fast kernel uses, chosen at run time: the plain release build is fast on a new CPU and runs on
//! an old one.

/// The instructions to use. They change the speed only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SimdLevel {
    /// What every CPU of the target has: SSE2 on x86-64.
    Scalar,
    /// 256-bit AVX2, with FMA and POPCNT.
    Avx2,
    /// 512-bit AVX-512 F, DQ and VL, with FMA and POPCNT.
    Avx512,
}

impl SimdLevel {
    /// All levels, slowest first.
    pub const ALL: [SimdLevel; 3] = [SimdLevel::Scalar, SimdLevel::Avx2, SimdLevel::Avx512];

    /// The best level this CPU has.
    pub fn detect() -> SimdLevel {
        #[cfg(target_arch = "x86_64")]
        {
            // A virtual machine may hide one of these alone, which kernels are compiled for.
            if !is_x86_feature_detected!("fma") || !is_x86_feature_detected!("popcnt") {
                return SimdLevel::Scalar;
            }
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
            {
                return SimdLevel::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return SimdLevel::Avx2;
            }
        }
        SimdLevel::Scalar
    }
}
