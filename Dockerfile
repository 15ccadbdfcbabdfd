# The study with all that it needs: docs/how-to/reproduce.md. After the build it needs no network.
FROM python:3.12.11-slim-bookworm

# Compiles the kernel, and tells records the commit.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends gcc libc6-dev git \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /alignscores
COPY requirements.lock .
RUN pip install --no-cache-dir --quiet --require-hashes -r requirements.lock
COPY . .
RUN pip install --no-cache-dir --quiet --no-deps --no-build-isolation -e .

# Whoever runs it need not be root: caches of Snakemake and Matplotlib go where anybody may write.
ENV XDG_CACHE_HOME=/tmp/cache MPLCONFIGDIR=/tmp/cache/matplotlib
CMD ["snakemake", "figures", "--config", "results_dir=/results"]
