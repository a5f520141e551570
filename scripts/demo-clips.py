"""Makes the demo's ground-truth clips from files of `dynaskin simulate`.

    python3 scripts/demo-clips.py BODY DATA_FOLDER   (needs numpy and safetensors)

BODY, `female` or `male`, is the folder of `web/demo/clips` that they are for.

Takes motions that are made by formula and held out of training, never captures, keeps the seconds
with movement, and stores the offsets as a product: f16 `basis_m` [K, V, 3] times f32
`coefficients` [T, K] (a truncated singular value decomposition). Prints what that leaves out.
"""

import json
import sys
from pathlib import Path

import numpy as np
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

# Name in the demo, file of the data set, first and last second.
CLIPS = [
    ("one-leg-hop", "one-leg-hop-190-060__s0", 1.0, 5.0),
    ("jumping-jacks", "jumping-jacks-081-091__s0", 0.25, 4.25),
]
COMPONENTS = 48
LARGEST_BYTES = 1_000_000
OUT = Path(__file__).parent.parent / "web" / "demo" / "clips"


def make(out: Path, source: Path, start_seconds: float, end_seconds: float) -> None:
    with safe_open(source, "np") as file:
        metadata = file.metadata()
    if metadata["format"] != "dynaskin-clip" or metadata["version"] != "2":
        raise SystemExit(f"{source} is no clip of version 2")
    clip = load_file(source)
    if not np.all(clip["materials"] == 1):
        raise SystemExit(f"{source} is not of the usual tissue")
    rate_hz = float(metadata["rate_hz"])
    part = slice(round(start_seconds * rate_hz), round(end_seconds * rate_hz) + 1)
    offsets_m = clip["offsets_m"][part].astype(np.float64)
    frames, vertices, _ = offsets_m.shape

    left, values, right = np.linalg.svd(offsets_m.reshape(frames, -1), full_matrices=False)
    coefficients = (left[:, :COMPONENTS] * values[:COMPONENTS]).astype(np.float32)
    basis_m = right[:COMPONENTS].reshape(COMPONENTS, vertices, 3).astype(np.float16)
    kept_m = np.einsum("tk,kvc->tvc", coefficients, basis_m.astype(np.float64))
    misses_mm = 1000 * np.linalg.norm(kept_m - offsets_m, axis=2)

    tensors = {
        "basis_m": basis_m,
        "coefficients": coefficients,
        "vertices": clip["vertices"],
        "root_translation_m": clip["root_translation_m"][part].copy(),
        "parent_from_joint": clip["parent_from_joint"][part].copy(),
        "shape": clip["shape"],
    }
    kept = {key: metadata[key] for key in ("body_sha256", "rate_hz", "name")}
    # Which state of the simulator made it: networks may have learned from another one.
    method = str(json.loads(metadata["sim"])["method"])
    loss = {"mean_loss_mm": f"{misses_mm.mean():.3f}", "largest_loss_mm": f"{misses_mm.max():.2f}"}
    about = {"format": "dynaskin-clip-basis", "version": "1", **kept, "sim_method": method, **loss}
    out.parent.mkdir(parents=True, exist_ok=True)
    save_file(tensors, out, about)
    size = out.stat().st_size
    print(
        f"{out.name}: {frames} frames, {size / 1e6:.2f} MB; left out: mean {misses_mm.mean():.3f} mm, "
        f"largest {misses_mm.max():.2f} mm of {1000 * np.linalg.norm(offsets_m, axis=2).max():.1f} mm"
    )
    if size > LARGEST_BYTES:
        raise SystemExit(f"{out.name} is larger than {LARGEST_BYTES} bytes")


def main() -> None:
    if len(sys.argv) != 3 or sys.argv[1] not in ("female", "male"):
        raise SystemExit(__doc__)
    body, data = sys.argv[1], Path(sys.argv[2])
    for name, source, start_seconds, end_seconds in CLIPS:
        out = OUT / body / f"{name}.safetensors"
        make(out, data / f"{source}.safetensors", start_seconds, end_seconds)


if __name__ == "__main__":
    main()
