# The study with all that it needs: docs/how-to/reproduce.md. After the build it needs no network.
FROM python:3.12.11-slim-bookworm

# gcc compiles the registration; git tells the records of results which commit they are from, whoever runs it.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends gcc libc6-dev git \
    && rm -rf /var/lib/apt/lists/* \
    && git config --system --add safe.directory /alignscores

WORKDIR /alignscores
COPY requirements.lock .
RUN pip install --no-cache-dir --quiet --require-hashes -r requirements.lock
COPY . .
RUN pip install --no-cache-dir --quiet --no-deps -e .

# Results and .snakemake land in the working directory, a folder of the user; caches where anybody may write.
# Snakemake asks for the user's name, which a number has only here.
ENV XDG_CACHE_HOME=/tmp/cache MPLCONFIGDIR=/tmp/cache/matplotlib USER=anybody
WORKDIR /work
ENTRYPOINT ["snakemake", "--snakefile", "/alignscores/Snakefile"]
CMD ["figures"]
