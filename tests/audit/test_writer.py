"""The dump writer of docs/audit.md, compiled: a pass in C writes its dump with it, and the dump is audited."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from restir_ref.audit import audit_dump
from restir_ref.audit.__main__ import main
from tests.audit.planted import fields
from tests.audit.test_page import PAGE

COMPILER = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
compiled = pytest.mark.skipif(COMPILER is None, reason="no C compiler here: cc, gcc or clang")

(SHADER,) = re.findall(r"```hlsl\n(.*?)```", PAGE, re.DOTALL)
(HOST,) = re.findall(r"```c\n(.*?)```", PAGE, re.DOTALL)
PASS = """
#include <stdio.h>
#include <stdlib.h>
typedef unsigned int uint;
static float *Out;
%(shader)s
%(host)s
#define CLAMPED(J) ((J) > 2.0f ? 2.0f : (J))
/* a pass with Talbot weights over M inputs, the first of which is canonical; row: p_hat, W, J, c, p_hat_own, q, u */
static void pass(uint pixel, const float *row) {
    const float *p = row, *W = row + M, *J = row + 2 * M, *c = row + 3 * M, *own = row + 4 * M, *q = row + 5 * M;
    float u = row[5 * M + M * M], from[M][M], m[M], w[M], w_sum = 0, c_Y = 0, sum = 0;
    uint s = 0, i, j;
    for (i = 0; i < M; ++i) for (j = 0; j < M; ++j)
        from[i][j] = j == 0 ? p[i] : i == j ? (J[i] > 0 ? own[i] / J[i] : 0) : q[i * M + j];
    for (i = 0; i < M; ++i) {
        float below = 0;
        for (j = 0; j < M; ++j) below += c[j] * from[i][j];
        m[i] = below > 0 ? c[i] * from[i][i] / below : 0;
        w[i] = m[i] * p[i] * W[i] * %(jacobian)s;
        w_sum += w[i];
        c_Y += c[i];
    }
    for (i = 0; i < M; ++i) { sum += w[i]; if (u * w_sum < sum) { s = i; break; } }
    Dump(pixel, (float *)p, (float *)W, (float *)J, (float *)c, from, m, w, w_sum, s,
         w_sum > 0 ? w_sum / p[s] : 0, c_Y);
}
int main(int argc, char **argv) {
    int pixels = atoi(argv[1]), size = 5 * M + M * M + 1;
    float *rows = malloc(sizeof(float) * size * pixels);
    Out = malloc(sizeof(float) * STRIDE * pixels);
    FILE *in = fopen(argv[2], "rb"), *out = fopen(argv[3], "w");
    if (argc != 4 || !in || !out || fread(rows, sizeof(float) * size, pixels, in) != (size_t)pixels) return 1;
    for (int k = 0; k < pixels; ++k) pass(k, rows + k * size);
    write_dump(out, Out, pixels);
    return fclose(out);
}
"""
"""What the page shows, and around it what a renderer has: a buffer, a pass and a host."""


def dump_of(folder: Path, jacobian: str = "J[i]", pixels: int = 200) -> Path:
    """The dump of the pass, written by the program."""
    given = fields(n=pixels)
    assert len(given["p_hat"]) == 3
    names = ("p_hat", "W", "J", "c", "p_hat_own")
    rows = np.concatenate([*(given[name] for name in names), given["p_hat_from"].reshape(9, -1), given["u"][None]])
    rows.T.astype("f4").tofile(folder / "rows")
    source = PASS % {"shader": SHADER, "host": HOST, "jacobian": jacobian}
    (folder / "pass.c").write_text(source, encoding="utf-8")
    subprocess.run(
        [COMPILER, "-std=c99", "-Wall", "-Werror", "-o", folder / "pass", folder / "pass.c"], check=True, cwd=folder
    )
    subprocess.run([folder / "pass", str(pixels), folder / "rows", folder / "pass.csv"], check=True)
    return folder / "pass.csv"


@compiled
def test_a_right_pass_in_c_is_right_by_its_own_dump(tmp_path) -> None:
    report = audit_dump(dump_of(tmp_path))
    assert report.right, report
    assert {"p_hat_from", "m", "w", "w_sum", "W_Y", "c_Y"} <= set(report.compared)
    assert main([str(tmp_path / "pass.csv")]) == 0


MISTAKES = {
    "1.0f": "J left out of w",
    "(J[i] > 0 ? 1 / J[i] : 0)": "J inverted in w",
    "CLAMPED(J[i])": "J clamped in w to at most 2",
}


@compiled
@pytest.mark.parametrize("jacobian", MISTAKES)
def test_a_mistake_in_c_is_named_from_its_dump(jacobian, tmp_path) -> None:
    report = audit_dump(dump_of(tmp_path, jacobian))
    assert report.first.term == "w"
    assert [each.mistake for each in report.explanations if each.complete] == [MISTAKES[jacobian]], report
