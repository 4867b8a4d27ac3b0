"""Trains the network: train.py CONFIGURATION.toml -o FOLDER

Goes on from FOLDER/state.pt, where the same configuration stopped. Writes FOLDER/log.jsonl, FOLDER/state.pt, and at the end FOLDER/weights.pt. The seed says
all: the same configuration gives the same batches in the same order; the last digits of the weights are those of the processor and its threads.
With --bfloat16 (always so on a GPU) convolutions are of short numbers: half as long on processors that have AVX512-BF16, longer on others.
"""

import argparse
import json
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import torch

from batches import LOG_SIGMA, Batches
from export import weights_of
from network import WIDTHS, Network


def loss_of(outcome, truth, weight):
    """Negative logarithm of Laplace's density, and half the absolute error beside it."""
    disparity, log_error = outcome[:, 0], outcome[:, 1].clamp(*LOG_SIGMA)
    error = (disparity - truth).abs()
    total = weight.sum().clamp(min=1)
    likelihood = ((error * torch.exp(-log_error) + log_error) * weight).sum() / total
    mean = (error * weight).sum() / total
    return likelihood + 0.5 * mean, mean


def rate(step, steps, highest):
    """Up in the first hundredth, then down by a cosine to nearly nothing."""
    warm = max(steps // 100, 1)
    if step < warm:
        return highest * (step + 1) / warm
    part = (step - warm) / max(steps - warm, 1)
    return highest * (0.01 + 0.99 * 0.5 * (1 + torch.cos(torch.tensor(torch.pi * part)).item()))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configuration", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--begin", type=Path, metavar="WEIGHTS", help="weights.pt or archive to begin with; for `matched`, of a network without it")
    parser.add_argument("--steps", type=int, help="in the place of the configuration's")
    parser.add_argument("--seed", type=int, help="in the place of the configuration's")
    parser.add_argument("--bfloat16", action="store_true")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    args = parser.parse_args()
    settings = tomllib.loads(args.configuration.read_text())
    steps, seed = args.steps or settings["steps"], settings["seed"] if args.seed is None else args.seed
    args.out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(seed)
    matched = settings.get("matched", False)
    network = Network(settings.get("widths", WIDTHS), matched).to(args.device)
    if args.device == "cpu":
        network = network.to(memory_format=torch.channels_last)
    if args.begin:
        weights = weights_of(args.begin) if args.begin.suffix == ".zip" else torch.load(args.begin, weights_only=True)
        (network.widened if matched else network.load_state_dict)(weights)
    optimizer = torch.optim.AdamW(network.parameters(), lr=1e-3, weight_decay=1e-4)
    drawn = (settings["side_px"], settings["batch"], seed, settings["noise"], settings.get("shape"), matched)
    batches = Batches(settings["pairs"], *drawn)
    short = args.bfloat16 or args.device == "cuda"
    state, begin = args.out / "state.pt", 0
    if state.exists():
        kept = torch.load(state, map_location=args.device, weights_only=True)
        network.load_state_dict(kept["network"])
        optimizer.load_state_dict(kept["optimizer"])
        begin = kept["step"]
    count = sum(p.numel() for p in network.parameters())
    print(f"{count} weights, {len(batches)} pairs, {steps} steps from {begin} on {args.device}", flush=True)
    clock, mean = time.perf_counter(), 0.0

    def keep(step):
        aside = state.with_suffix(".aside")
        torch.save({"network": network.state_dict(), "optimizer": optimizer.state_dict(), "step": step}, aside)
        aside.rename(state)

    with (args.out / "log.jsonl").open("a") as log, ThreadPoolExecutor(1) as drawing:
        coming = drawing.submit(batches.batch, begin)
        for step in range(begin, steps):
            drawn, coming = coming.result(), drawing.submit(batches.batch, step + 1)
            for group in optimizer.param_groups:
                group["lr"] = rate(step, steps, settings["rate"])
            views, truth, weight, said = (None if x is None else x.to(args.device) for x in drawn)
            with torch.autocast(args.device, torch.bfloat16, enabled=short):
                outcome = network(views, said)
            loss, error = loss_of(outcome.float(), truth, weight)
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
            mean += error.item() / 50
            if (step + 1) % 50 == 0:
                seconds = time.perf_counter() - clock
                print(f"step {step + 1}/{steps} · error {mean:.3f} px · {seconds:.0f} s", flush=True)
                log.write(json.dumps({"step": step + 1, "error_px": mean, "seconds": seconds}) + "\n")
                log.flush()
                mean = 0.0
            if (step + 1) % 500 == 0:
                keep(step + 1)
    keep(steps)
    torch.save(network.state_dict(), args.out / "weights.pt")


if __name__ == "__main__":
    main()
