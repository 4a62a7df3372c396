"""A cluster that asks for certificates is reached at its tls:// address, and only with them."""

import asyncio
import json
import os
import shutil
import subprocess
import sys
import time

import pytest

from daq_app.batch import pool

OPENSSL = shutil.which("openssl")


@pytest.fixture
def certificate(tmp_path):
    """Return a certificate and its key that vouch for themselves, for this test alone."""
    cert, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    command = [OPENSSL, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost"]
    subprocess.run([*command, "-keyout", str(key), "-out", str(cert)], check=True, capture_output=True)
    return cert, key


@pytest.fixture
def address(tmp_path, certificate):
    """Return the address of a scheduler that speaks to holders of the certificate alone."""
    cert, key = map(str, certificate)
    file = tmp_path / "scheduler.json"
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "tls://127.0.0.1:0", "--no-dashboard"]
    command += ["--tls-ca-file", cert, "--tls-cert", cert, "--tls-key", key, "--scheduler-file", str(file)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=os.environ) as scheduler:
        try:
            start = time.monotonic()
            while not file.is_file() or not file.read_text().endswith("}"):
                assert time.monotonic() - start < 60.0
                time.sleep(0.05)
            yield json.loads(file.read_text())["address"]
        finally:
            scheduler.kill()


@pytest.mark.slow
@pytest.mark.skipif(OPENSSL is None, reason="no openssl to make a certificate")
def test_a_scheduler_with_certificates_answers_who_has_them_and_refuses_others(certificate, address, monkeypatch):
    distributed, dask = pytest.importorskip("distributed"), pytest.importorskip("dask")
    cert, key = map(str, certificate)
    tls = "distributed.comm.tls."
    with dask.config.set({f"{tls}ca-file": cert, f"{tls}client.cert": cert, f"{tls}client.key": key}):
        kind = asyncio.run(pool._identity(distributed, address, distributed.Security()))
    assert address.startswith("tls://")
    assert kind == "Scheduler"
    monkeypatch.setattr(pool, "_ANSWERS", 5.0)
    with pytest.raises(pool.SchedulerError, match="no Dask scheduler answers there"):
        asyncio.run(pool._identity(distributed, address, distributed.Security()))
