"""What holds for the files of the project as a whole."""

from __future__ import annotations

import importlib.metadata
import re
import tomllib

import pytest
import repository

import mlrt_plugin

LINE_LIMIT = 400
# In pieces, lest this file be found.
FOLDERS = "|".join(["work", "root", "home", "farm", "tmp"])
MACHINE_PATH = re.compile(rf"(?<![\w.~/-])/({FOLDERS})/")


def project_version() -> str:
    text = (repository.ROOT / "pyproject.toml").read_text()
    version = tomllib.loads(text)["project"]["version"]
    assert isinstance(version, str)
    return version


def test_version_of_package_and_installation() -> None:
    assert mlrt_plugin.__version__ == project_version()
    assert importlib.metadata.version("mlrt") == project_version()


def test_version_of_the_citation() -> None:
    file = repository.ROOT / "CITATION.cff"
    if not file.is_file():
        pytest.skip("there is no CITATION.cff")
    versions = re.findall(r"^version:\s*['\"]?([^'\"\s]+)", file.read_text(), re.MULTILINE)
    assert versions == [project_version()]


def test_version_is_in_the_changelog() -> None:
    text = (repository.ROOT / "CHANGELOG.md").read_text()
    assert re.search(rf"^## .*{re.escape(project_version())}", text, re.MULTILINE)


def test_files_answer_one_question() -> None:
    files = repository.tracked_files("*.h", "*.cpp", "*.py")
    assert len(files) > 10
    lengths = {
        file: len((repository.ROOT / file).read_text().splitlines()) for file in files
    }
    assert {str(file): lines for file, lines in lengths.items() if lines > LINE_LIMIT} == {}


def test_no_paths_of_a_machine() -> None:
    found = []
    for file in repository.tracked_files("*"):
        try:
            text = (repository.ROOT / file).read_text()
        except UnicodeDecodeError:
            continue
        found += [f"{file}: {match[0]}" for match in MACHINE_PATH.finditer(text)]
    assert found == []


def test_paths_of_a_machine_are_found() -> None:
    slash = "/"
    assert MACHINE_PATH.search(f"open('{slash}home/someone/scene.xml')")
    assert not MACHINE_PATH.search(f"https://example.org{slash}home/page")
