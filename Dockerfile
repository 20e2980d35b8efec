# An image with the program alone, for runs without a screen:
#   docker build -t scalpel .
#   docker run --rm -v "$PWD/out:/home/surgeon/out" scalpel run slab
# The page is served on the loopback interface alone, so `view` needs the network of the host (Linux):
#   docker run --rm --network host scalpel view
FROM python:3.13-slim AS wheel
COPY . /source
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels /source

FROM python:3.13-slim
# OpenGL for images, without a screen and a graphics card: some 200 MB, most of it LLVM. All else works without it.
RUN apt-get update && apt-get install --yes --no-install-recommends libegl1 libgl1-mesa-dri libopengl0 \
    && rm -rf /var/lib/apt/lists/*
COPY --from=wheel /wheels /wheels
RUN pip install --no-cache-dir /wheels/*.whl && rm -r /wheels
RUN useradd --create-home surgeon
USER surgeon
WORKDIR /home/surgeon
# Kernels are compiled for the processor that compiles: those of the machine that builds the image would
# serve its like alone. A volume at this folder keeps them from one container to the next.
ENV NUMBA_CACHE_DIR=/home/surgeon/kernels
RUN mkdir kernels out
ENTRYPOINT ["scalpel-sim"]
CMD ["--help"]
