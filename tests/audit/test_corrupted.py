"""Any readable dump, corrupted anywhere, yields a report; any unreadable one a refusal on one line, and status 2."""

import zipfile
from collections import Counter
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import pytest

from restir_ref.audit import BadDump, audit_dump, files, load, mistakes
from restir_ref.audit.__main__ import main
from restir_ref.audit.mistakes import Mistake, other, weighted
from restir_ref.batch import ratio, total
from tests.audit.corrupted import BASES, FAMILIES, Family, one_of, right


def outcome_of_mapping(dump: Any) -> str:
    """A report or a refusal on one line; anything else is raised."""
    try:
        said = str(audit_dump(dump))
    except BadDump as refused:
        return "refusal" if is_one_line(str(refused)) else "lines"
    assert said.startswith(("right: ", "WRONG: ", "SUSPICIOUS: "))
    return "report"


def outcome_of_file(path: Path, capsys: Any) -> str:
    """The same of the command, by its exit status and what it prints."""
    status = main([str(path)])
    out, err = capsys.readouterr()
    if status == 2:
        assert out == ""
        assert err.startswith("cannot read the dump: ")
        assert is_one_line(err.removesuffix("\n"))
        return "refusal"
    assert out.startswith((("right: ",), ("WRONG: ", "SUSPICIOUS: "))[status])
    assert err == ""
    return "report"


def is_one_line(text: str) -> bool:
    return text.splitlines() == [text] and len(text) < 2000


def outcomes(name: str, family: Family, folder: Path, capsys: Any) -> Counter[str]:
    rng, found = np.random.default_rng(crc32(name.encode())), Counter[str]()
    for k in range(family.count):
        broken = family.corrupt(one_of(BASES, rng), rng)
        if not family.suffix:
            found[outcome_of_mapping(broken)] += 1
            continue
        path = folder / f"{k}{family.suffix}"
        path.write_bytes(broken)
        found[outcome_of_file(path, capsys)] += 1
    return found


def test_there_are_two_thousand_of_them() -> None:
    assert sum(family.count for family in FAMILIES.values()) >= 2000


@pytest.mark.parametrize("name", FAMILIES)
def test_a_corrupted_dump_is_reported_or_refused_on_one_line(name, tmp_path, capsys) -> None:
    family = FAMILIES[name]
    found = outcomes(name, family, tmp_path, capsys)
    assert found.total() == family.count
    assert family.readable is None or found.keys() == {"report" if family.readable else "refusal"}, found
    assert family.readable is not None or len(found) == 2, "a family that may be either should show both"


# ---------------------------------------------------------------- archives and passes that would fill the memory


def test_an_archive_that_unpacks_to_too_much_is_not_unpacked(tmp_path, monkeypatch) -> None:
    dump = {**BASES[0], "note": np.zeros(10**6)}
    np.savez_compressed(tmp_path / "bomb.npz", **dump)
    assert audit_dump(tmp_path / "bomb.npz").right
    monkeypatch.setattr(files, "MOST_BYTES", 8 * 10**6)
    monkeypatch.setattr(np, "load", pytest.fail)
    with pytest.raises(BadDump, match=r"bomb.npz unpacks to \d+ bytes, more than the limit of 8000000: dump fewer"):
        audit_dump(tmp_path / "bomb.npz")


def test_a_pass_that_does_not_fit_into_memory_is_refused_by_the_command(tmp_path, capsys, monkeypatch) -> None:
    def exhausted(*_: Any, **__: Any) -> None:
        raise MemoryError

    np.savez(tmp_path / "a.npz", **BASES[0])
    monkeypatch.setattr("restir_ref.audit.__main__.audit_dump", exhausted)
    assert outcome_of_file(tmp_path / "a.npz", capsys) == "refusal"


def test_a_file_that_may_not_be_read_is_refused(tmp_path, capsys, monkeypatch) -> None:
    def forbidden(*_: Any, **__: Any) -> None:
        raise PermissionError(13, "Permission denied")

    (tmp_path / "a.json").write_text("{}")
    monkeypatch.setattr(Path, "read_text", forbidden)
    assert outcome_of_file(tmp_path / "a.json", capsys) == "refusal"
    assert outcome_of_file(tmp_path / f"{'long' * 99}.npz", capsys) == "refusal"


# ---------------------------------------------------------------- numbers that overflow where they meet


def test_a_term_that_overflows_is_wrong_whatever_was_dumped() -> None:
    """p_hat_from_i(y_i) = p_hat_i(X_i) / J beyond the largest float64, under weights that do not read it."""
    dump = right("constant", (1, 0))
    J, own = dump["J"].copy(), dump["p_hat_own"].copy()
    J[1], own[1] = 5e-324, 1
    report = audit_dump({**dump, "J": J, "p_hat_own": own})
    assert (report.first.term, report.first.expected) == ("p_hat_from", np.inf)


def test_weights_that_overflow_are_refused_with_the_column_and_the_remedy() -> None:
    dump = right("talbot", (1, 0))
    J, own = dump["J"].copy(), dump["p_hat_own"].copy()
    J[1, 1], own[1] = 5e-324, 1
    with pytest.raises(BadDump, match=r"overflow where they meet .* column 1 .* write 0 for what is below 1e-75"):
        audit_dump({**dump, "J": J, "p_hat_own": own})


# ---------------------------------------------------------------- twins


def unguarded_pairwise(i, q, c):
    """Pairwise weights that take a canonical input and another one for granted."""
    p_hat = q(c.canonical[0])
    if i in c.canonical:
        return total([ratio(c[j] * p_hat, c.C_R * q(j) + c.C_N * p_hat) for j in c.others])
    return ratio(c[i] * q(i), c.C_R * q(i) + c.C_N * p_hat)


@pytest.mark.parametrize(("pattern", "crash"), [((1,), TypeError), ((1, 1), TypeError), ((0, 0), IndexError)])
def test_a_suspect_that_takes_inputs_for_granted_is_noticed(pattern, crash, monkeypatch) -> None:
    wrong = {**right("talbot", pattern), "W_Y": np.full(2, 7.0)}
    assert outcome_of_mapping(wrong) == "report"
    suspect = Mistake("unguarded", "", weighted(other(unguarded_pairwise)))
    monkeypatch.setattr(mistakes, "MISTAKES", (suspect,))
    with pytest.raises(crash):
        outcome_of_mapping(wrong)


def test_a_reader_that_expects_some_errors_only_is_noticed(tmp_path, monkeypatch, capsys) -> None:
    def expecting(path: Path, folder: Path) -> Any:
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
                return {name: archive[name] for name in archive.files}
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            raise BadDump("damaged") from error

    monkeypatch.setattr(load, "read", expecting)
    with pytest.raises(Exception):  # noqa: B017, PT011 - whatever a decoder raises
        outcomes("bytes of its directory", FAMILIES["bytes of its directory"], tmp_path, capsys)


def test_a_refusal_on_two_lines_is_noticed() -> None:
    assert not is_one_line("'format' is [[1 1]\n [1 1]]")
    assert is_one_line(str(BadDump("'format' is [[1 1]\n [1 1]]")))
