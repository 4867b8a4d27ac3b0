"""Writes trained weights as an ONNX graph in a zip archive: export.py FOLDER/weights.pt -o network.zip

The graph takes `views` (1, 2, H, W) float32, H and W multiples of 64, and, if it was trained so or with --alone,
`matched` (1, 2, H/2, W/2) float32; it gives `outcome` (1, 2, H/2, W/2) float32.
"""

import argparse
import io
import zipfile
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import TensorProto, numpy_helper

from network import Network


def weights_of(archive):
    """Weights of an archive, as they were rounded."""
    with zipfile.ZipFile(archive) as entries:
        model = onnx.load_from_string(entries.read("network.onnx"))
    weights = {w.name: torch.from_numpy(numpy_helper.to_array(w).copy()) for w in model.graph.initializer}
    return {name: w for name, w in weights.items() if name.endswith((".weight", ".bias"))}


def rounded(model):
    """Weights rounded to half floats. They stay float32, which every runtime reads; their empty bits leave the archive half as large."""
    for weight in model.graph.initializer:
        if weight.data_type == TensorProto.FLOAT and np.prod(weight.dims) >= 64:
            values = numpy_helper.to_array(weight).astype(np.float16).astype(np.float32)
            weight.CopyFrom(numpy_helper.from_array(values, weight.name))
    onnx.checker.check_model(model)
    return model


class Alone(torch.nn.Module):
    """A network that takes what matching found and leaves it aside: qpalgo then does not join its answer with matching's."""

    def __init__(self, network):
        super().__init__()
        self.network = network

    def forward(self, views, matched):
        return self.network(views) + 0 * matched


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--alone", action="store_true", help="its answer is not joined with that of matching")
    parser.add_argument("-o", "--out", type=Path, required=True)
    args = parser.parse_args()
    network = Network.of(torch.load(args.weights, weights_only=True, map_location="cpu"))
    network.eval()
    takes = {"views": torch.zeros(1, 2, 128, 192)}
    if args.alone and network.enter.in_channels == 16:
        network = Alone(network)
    if args.alone or network.enter.in_channels == 18:
        takes["matched"] = torch.zeros(1, 2, 64, 96)
    graph = io.BytesIO()
    torch.onnx.export(
        network,
        tuple(takes.values()),
        graph,
        input_names=list(takes),
        output_names=["outcome"],
        dynamic_axes={"views": {2: "height", 3: "width"}} | ({"matched": {2: "high", 3: "wide"}} if "matched" in takes else {}),
        opset_version=17,
        dynamo=False,
    )
    model = rounded(onnx.load_from_string(graph.getvalue()))
    with zipfile.ZipFile(args.out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        # One date, so that the same weights give the same bytes.
        archive.writestr(zipfile.ZipInfo("network.onnx", (2020, 1, 1, 0, 0, 0)), model.SerializeToString(), zipfile.ZIP_DEFLATED)
    print(f"{args.out.stat().st_size / 1e6:.2f} MB: {args.out}")


if __name__ == "__main__":
    main()
