//! Matching side by side with OpenCV's matchers on pairs whose shift is known.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use opencv_checks::CHANGES;
use opencv_checks::accuracy::{planar, stereo};

#[test]
fn errors_are_below_those_of_opencvs_flows_and_phase_correlation() {
    for change in CHANGES {
        let rms = planar(change).unwrap();
        println!("{change:?}: {rms:.4?}");
        assert!(rms.valid > 0.95, "{rms:?}");
        for theirs in [
            rms.farneback[0],
            rms.farneback[1],
            rms.pyr_lk,
            rms.phase_correlate,
        ] {
            assert!(rms.ours < theirs, "{rms:?}");
        }
    }
}

#[test]
fn errors_are_below_those_of_opencvs_stereo_matchers() {
    for change in CHANGES {
        let rms = stereo(change).unwrap();
        println!("{change:?}: {rms:.4?}");
        assert!(
            rms.valid > 0.95 && rms.bm_valid > 0.5 && rms.sgbm_valid > 0.5,
            "{rms:?}"
        );
        assert!(
            rms.ours_at_bm < rms.bm && rms.ours_at_sgbm < rms.sgbm,
            "{rms:?}"
        );
    }
}
