"""Trains the network: train.py CONFIGURATION.toml -o FOLDER

Goes on from FOLDER/state.pt, where the same configuration stopped. Writes FOLDER/log.jsonl, FOLDER/state.pt, and at the end FOLDER/weights.pt. The seed says
all: the same configuration gives the same batches in the same order; the last digits of the weights are those of the processor and its threads.
With --bfloat16 (always so on a GPU) convolutions are of short numbers: half as long on processors that have AVX512-BF16, longer on others.
"""

import argparse
import json
import time
import tomllib
from pathlib import Path

import torch

from batches import CROSSTALK, LOG_SIGMA, Batches, pair_files
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


class Training:
    """Steps of an optimiser. On a GPU one step is recorded as a graph and replayed: its kernels are short, and launching them takes longer."""

    #: Steps taken before one is recorded.
    FIRST = 12

    def __init__(self, network, short):
        self.network, self.short = network, short
        self.device = next(network.parameters()).device
        on_gpu = self.device.type == "cuda"
        rate = torch.tensor(1e-3, device=self.device) if on_gpu else 1e-3
        self.optimizer = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=1e-4, capturable=on_gpu)
        self.error, self.taken = torch.zeros((), device=self.device), 0
        self.graph, self.given, self.left = None, None, self.FIRST if on_gpu else None

    def step(self, batch, rate):
        """One step on views, truth, weight and what was matched."""
        self.taken += 1
        for group in self.optimizer.param_groups:
            if self.left is None:
                group["lr"] = rate
            else:
                group["lr"].fill_(rate)
        if self.left is None:
            self._step(*batch)
        elif self.left > 0:
            # What is recorded later must have run on another stream before.
            self.left -= 1
            aside = torch.cuda.Stream()
            aside.wait_stream(torch.cuda.current_stream())
            with torch.cuda.stream(aside):
                self._step(*batch)
            torch.cuda.current_stream().wait_stream(aside)
        else:
            if self.graph is None:
                self.given = [None if x is None else x.clone() for x in batch]
                self.graph = torch.cuda.CUDAGraph()
                self.optimizer.zero_grad(set_to_none=True)
                with torch.cuda.graph(self.graph):
                    self._step(*self.given)
            for given, x in zip(self.given, batch, strict=True):
                if x is not None:
                    given.copy_(x)
            self.graph.replay()

    def _step(self, views, truth, weight, said):
        self.optimizer.zero_grad(set_to_none=True)
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.short, cache_enabled=False):
            outcome = self.network(views, said)
        loss, error = loss_of(outcome.float(), truth, weight)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self.optimizer.step()
        self.error += error.detach()

    def mean_error(self):
        """Mean of the steps since it was asked last, px."""
        mean = self.error.item() / max(self.taken, 1)
        self.error.zero_()
        self.taken = 0
        return mean


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configuration", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--begin", type=Path, metavar="WEIGHTS", help="weights.pt or archive to begin with; for `matched`, of a network without it")
    parser.add_argument("--steps", type=int, help="in the place of the configuration's")
    parser.add_argument("--seed", type=int, help="in the place of the configuration's")
    parser.add_argument("--data", type=Path, default=Path(__file__).resolve().parent / "data", help="folder of make-data")
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
        weights = weights_of(args.begin) if args.begin.suffix == ".zip" else torch.load(args.begin, weights_only=True, map_location="cpu")
        (network.widened if matched else network.load_state_dict)(weights)
    drawn = {"shape": settings.get("shape"), "crosstalk": settings.get("crosstalk", CROSSTALK), "matched": matched, "device": args.device}
    files = pair_files(settings["pairs"], args.data)
    batches = Batches(files, settings["side_px"], settings["batch"], seed, settings["noise"], **drawn)
    training = Training(network, short=args.bfloat16 or args.device == "cuda")
    state, begin = args.out / "state.pt", 0
    if state.exists():
        kept = torch.load(state, map_location=args.device, weights_only=True)
        network.load_state_dict(kept["network"])
        training.optimizer.load_state_dict(kept["optimizer"])
        begin = kept["step"]
    count = sum(p.numel() for p in network.parameters())
    print(f"{count} weights, {len(batches)} pairs, {steps} steps from {begin} on {args.device}", flush=True)
    clock = time.perf_counter()

    def keep(step):
        aside = state.with_suffix(".aside")
        torch.save({"network": network.state_dict(), "optimizer": training.optimizer.state_dict(), "step": step}, aside)
        aside.rename(state)

    with (args.out / "log.jsonl").open("a") as log:
        for step in range(begin, steps):
            training.step(batches.batch(step), rate(step, steps, settings["rate"]))
            if (step + 1) % 50 == 0:
                seconds, mean = time.perf_counter() - clock, training.mean_error()
                print(f"step {step + 1}/{steps} · error {mean:.3f} px · {seconds:.0f} s", flush=True)
                log.write(json.dumps({"step": step + 1, "error_px": mean, "seconds": seconds}) + "\n")
                log.flush()
            if (step + 1) % 500 == 0:
                keep(step + 1)
    keep(steps)
    torch.save(network.state_dict(), args.out / "weights.pt")


if __name__ == "__main__":
    main()
