# One image for every service of docker-compose.yml. By itself it runs all of it in one container (`parenting up`).
FROM python:3.11-slim AS wheel
WORKDIR /source
COPY constraints.txt .
RUN pip install --no-cache-dir -c constraints.txt setuptools
COPY . .
RUN pip wheel --no-deps --no-build-isolation --wheel-dir /wheel .

FROM python:3.11-slim
# A number, so that nobody has to look it up: who mounts a folder of his own gives it to this user.
RUN groupadd --gid 10001 parenting \
    && useradd --uid 10001 --gid 10001 --no-create-home --home-dir /data --shell /usr/sbin/nologin parenting \
    && install -d -o 10001 -g 10001 -m 700 /data \
    && install -d -m 1777 /run/postgresql

# The libraries have a layer of their own, which stands until their list changes. pip's plain torch for Linux is the
# build for CUDA: gigabytes that this program, which computes on the CPU, never uses. PyTorch keeps the build for CPUs
# on a package index of its own; its installation guide gives the address. Pass it as TORCH_INDEX to get a small image:
#     docker build --build-arg TORCH_INDEX=ADDRESS .
ARG TORCH_INDEX=""
WORKDIR /libraries
COPY pyproject.toml constraints.txt ./
RUN python -c "import tomllib; of = tomllib.load(open('pyproject.toml', 'rb'))['project']; \
print(*of['dependencies'], *of['optional-dependencies']['postgres'], sep='\n')" > requirements.txt \
    && if [ -n "$TORCH_INDEX" ]; then \
        PIP_INDEX_URL="$TORCH_INDEX" pip install --no-cache-dir --no-deps -c constraints.txt torch; fi \
    && pip install --no-cache-dir -c constraints.txt -r requirements.txt

RUN --mount=type=bind,from=wheel,source=/wheel,target=/wheel \
    pip install --no-cache-dir --no-deps /wheel/*.whl

# Byte code for everything that a start imports: pip compiles what it installs, but this image comes without that of the
# standard library, and the user below cannot write it. Each of the processes would compile it at each start.
RUN python -m compileall -q -j 0 -x '/(site-packages|test|tests|idlelib|lib2to3)/' \
        "$(python -c 'import sysconfig; print(sysconfig.get_path("stdlib"))')" \
    && python -c "import importlib.util as found, os; names = ('asyncio', 'json', 'torch', 'fastapi', 'parenting.server.app'); \
exit([name for name in names if not os.path.exists(found.cache_from_source(found.find_spec(name).origin))] or None)"

# Nothing here lets the server listen beyond its container: that is for whoever publishes the port (docs/deployment.md).
ENV PYTHONUNBUFFERED=1 PARENTING_DATA=/data PARENTING_PORT=8765
VOLUME /data
WORKDIR /data
USER 10001:10001
EXPOSE 8765
# Asked directly: a proxy that the environment names would not find this address.
HEALTHCHECK --interval=15s --timeout=5s --start-period=60s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request as ask; ask.build_opener(ask.ProxyHandler({})).open('http://127.0.0.1:%s/healthz' % os.environ['PARENTING_PORT'], timeout=3)"]
CMD ["parenting", "up", "--no-browser"]
