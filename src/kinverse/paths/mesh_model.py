"""A URDF or MJCF model with geometry, read safely and handed to MuJoCo."""

import os
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from kinverse.errors import ModelError
from kinverse.loading.mjcf_parts import with_includes
from kinverse.loading.text import parse_xml, read_bytes
from kinverse.paths.mujoco_model import mujoco_or_extra

__all__ = ["mesh_model"]

Element = ElementTree.Element


def mesh_model(model: str | os.PathLike[str], folder: str | os.PathLike[str] | None) -> Any:
    """The ``MjSpec`` of a model, ready to be changed and compiled.

    Args:
        model: a .urdf or .xml file, or the text of one.
        folder: which files the model may read lie in it or below; None: the file's own. The
            files of ``package://name/...`` are looked for in ``folder/name`` and in ``folder``.

    Raises:
        ModelError: no such file, a DOCTYPE, a mesh that is missing or outside the folder, or what
            MuJoCo says of the model.
        MissingExtra: MuJoCo is not installed.
    """
    mujoco = mujoco_or_extra("collision of meshes")
    path, where, data = _read(model, folder)
    inside = Path(folder).resolve() if folder is not None else path.resolve().parent
    root = parse_xml(data, where)
    if root.tag == "mujoco":
        root = with_includes(root, path)
        _check_mjcf(root, path.resolve().parent, inside, where)
    elif root.tag == "robot":
        _prepare_urdf(root, path.resolve().parent, inside, where)
    else:
        raise ModelError(
            f"{where}: root element <{root.tag}> is neither URDF (<robot>) nor MJCF (<mujoco>)"
        )
    try:
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    except ValueError as error:
        raise ModelError(f"{where}: {error}") from error
    spec.modelfiledir = str(path.resolve().parent)
    # pictures are not needed, and masses not even to be right
    spec.compiler.discardvisual = True
    spec.compiler.boundmass = spec.compiler.boundinertia = 1e-6
    return spec


def _read(model: str | os.PathLike[str], folder: Any) -> tuple[Path, str, bytes]:
    """Path, name for messages, and content; a text stands in the folder, or in the current one."""
    if isinstance(model, str) and model.lstrip().startswith("<"):
        return Path(folder or ".") / "model.xml", "the model", model.encode()
    path = Path(model)
    return path, path.name, read_bytes(path)


def _check_mjcf(root: Element, here: Path, inside: Path, where: str) -> None:
    """Every file that the model names stays inside, whatever folder it is counted from."""
    folders = {here}
    for compiler in root.iter("compiler"):
        for name in ("assetdir", "meshdir", "texturedir"):
            folders.add(here / compiler.get(name, "."))
    for element in root.iter():
        for name, value in element.attrib.items():
            if name.startswith("file"):
                for start in folders:
                    _inside(start / value, inside, value, where)


def _prepare_urdf(root: Element, here: Path, inside: Path, where: str) -> None:
    """Meshes by their own paths, no pictures, and links that are fixed stay bodies."""
    settings = root.find("mujoco")
    if settings is None:
        settings = ElementTree.SubElement(root, "mujoco")
    compiler = settings.find("compiler")
    if compiler is None:
        compiler = ElementTree.SubElement(settings, "compiler")
    compiler.attrib.update(strippath="false", fusestatic="false")
    for name in ("assetdir", "meshdir", "texturedir"):
        compiler.attrib.pop(name, None)
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for mesh in root.iter("mesh"):
        mesh.set("filename", str(_mesh(mesh.get("filename", ""), here, inside, where)))


def _mesh(name: str, here: Path, inside: Path, where: str) -> Path:
    plain = name.removeprefix("file://")
    places = [here / plain, inside / plain]
    if name.startswith("package://"):
        package, _, rest = name.removeprefix("package://").partition("/")
        places = [inside / package / rest, inside / rest]
    for place in places:
        found = _resolved(place, name, where)
        if found.is_relative_to(inside) and found.is_file():
            return found
    _inside(places[0], inside, name, where)
    looked = " and ".join(dict.fromkeys(map(str, places)))
    raise ModelError(
        f"{where}: no mesh file {name!r}, looked for {looked}; folder= names the folder that holds"
        " the meshes"
    )


def _inside(place: Path, inside: Path, name: str, where: str) -> None:
    """Refuse a file that lies elsewhere."""
    if not _resolved(place, name, where).is_relative_to(inside):
        raise ModelError(
            f"{where}: file {name!r} lies outside {inside}; folder= names the folder that holds all"
        )


def _resolved(place: Path, name: str, where: str) -> Path:
    try:
        found = place.resolve()
        found.is_file()  # a name that is too long is an error here
    except (OSError, ValueError, RuntimeError) as error:
        raise ModelError(f"{where}: cannot read {name!r}: {error}") from error
    return found
