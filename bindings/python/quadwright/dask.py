"""Thousands of models on a cluster, by Dask distributed (`pip install quadwright[dask]`; Debian: python3-distributed)."""
import os

from . import _result_of_file, _with_options


def _remesh_one(source, target, options):
    try:
        return _result_of_file(source, target, options)
    except Exception as error:  # one model's failure is one record, whatever it is
        return {"input": source, "output": None, "status": getattr(error, "status", type(error).__name__), "message": str(error)}


@_with_options
def remesh_many(paths, out, /, *, client, retries=3, format="obj", time_limit=None, unwrap=False, bake=None, **options):
    """Remeshes files on the workers of a dask.distributed.Client: a list of records (dict), in the order of paths.

    out: a folder that all workers see; the quads of a/b.ply go to out/b.ply.quads.obj, written whole or not at all, and two paths may not
    have the same name. A record has "input", "output", "status" ("OK", or that of the failure), "message" and, of a success, "report". A file
    that is there already, with its record, is not made again. time_limit (of each file), unwrap and bake as of remesh(): with bake the files are assets, and beside those in OBJ lie an
    MTL and PNG files. A worker that is lost has its models done by others, up to `retries` times.
    """
    options.update({name: value for name, value in (("unwrap", unwrap), ("bake", bake)) if value})
    if time_limit is not None:
        options["time_limit"] = time_limit
    paths = [os.fspath(path) for path in paths]
    targets = [os.path.join(os.fspath(out), f"{os.path.basename(path)}.quads.{format}") for path in paths]
    if len(set(targets)) != len(targets):
        raise ValueError("paths: two of them have the same name")
    os.makedirs(out, exist_ok=True)
    options.setdefault("threads", 1)  # the workers are the parallelism; never changes a result
    futures = [client.submit(_remesh_one, path, target, options, pure=False, retries=retries) for path, target in zip(paths, targets)]
    return client.gather(futures)
