# The explicit models for those without Debian:  docker build -t rail-fem .
#   docker run --rm -v "$PWD/runs:/rail-fem/runs" rail-fem run cases/nose_transfer.toml --out runs/nose_transfer
FROM debian:13-slim
WORKDIR /rail-fem
COPY . .
RUN ./setup.sh && rm -rf /var/lib/apt/lists/* /root/.cache
ENV OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 LC_ALL=C.UTF-8
ENTRYPOINT [".venv/bin/rail-fem"]
CMD ["--help"]
