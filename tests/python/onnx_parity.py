"""Checks a model's ONNX files and runs them in onnxruntime beside numbers that tract gave.

Usage: onnx_parity.py MODEL_FOLDER < case.json

`case.json` holds `features` [tick][F], and what tract made of them: `latents` [tick][L] and
`offsets_m` [tick][V * 3]; `tolerance` is the largest difference allowed, as a share of the largest
number of its kind. Ends with status 1 and a sentence where a file is invalid or a number differs.
"""

import json
import sys
from pathlib import Path

import numpy as np
import onnx
import onnxruntime


def open_network(path: Path) -> onnxruntime.InferenceSession:
    onnx.checker.check_model(onnx.load(path), full_check=True)
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 3
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def run_networks(folder: Path, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    bundle = json.loads((folder / "bundle.json").read_text())
    predictor = open_network(folder / bundle["predictor"]["file"])
    decoder = open_network(folder / bundle["decoder"]["file"])
    states = {
        node.name: np.zeros(node.shape, np.float32)
        for node in predictor.get_inputs()
        if node.name.startswith("state_")
    }
    names = [node.name for node in predictor.get_outputs()]
    latents, offsets_m = [], []
    for row in features:
        out = dict(zip(names, predictor.run(None, {"features": row[None], **states})))
        states = {name: out[f"{name}_out"] for name in states}
        latents.append(out["latent"][0])
        offsets_m.append(decoder.run(["offsets"], {"latent": out["latent"]})[0].reshape(-1))
    return np.array(latents), np.array(offsets_m)


def relative_difference(ours: np.ndarray, theirs: np.ndarray) -> float:
    if ours.shape != theirs.shape:
        sys.exit(f"tract gave {ours.shape} numbers, onnxruntime {theirs.shape}")
    if not np.isfinite(theirs).all():
        sys.exit("onnxruntime gave numbers that are not finite")
    largest = np.abs(theirs).max()
    if largest == 0:
        sys.exit("all numbers are 0: the networks do nothing")
    return float(np.abs(ours - theirs).max() / largest)


def main() -> None:
    folder = Path(sys.argv[1])
    case = json.load(sys.stdin)
    latents, offsets_m = run_networks(folder, np.array(case["features"], np.float32))
    differences = {
        "latents": relative_difference(np.array(case["latents"]), latents),
        "offsets": relative_difference(np.array(case["offsets_m"]), offsets_m),
    }
    peak_mm = 1000 * np.linalg.norm(offsets_m.reshape(len(latents), -1, 3), axis=2).max()
    print(
        f"{len(latents)} ticks, peak offset {peak_mm:.1f} mm, relative difference "
        + ", ".join(f"{name} {value:.1e}" for name, value in differences.items())
    )
    for name, value in differences.items():
        if value > case["tolerance"]:
            sys.exit(f"{name} differ by {value:.2e} of their largest, over {case['tolerance']}")


if __name__ == "__main__":
    main()
