# FRobs with all plugins:
#   docker build --tag frobs .
#   docker run --rm --interactive --tty frobs
FROM python:3.11-slim-bookworm

# OpenGL without a display (EGL, and OSMesa as the second choice), and the tools of the development container.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libegl1 libgl1-mesa-dri libosmesa6 git make \
    && rm -rf /var/lib/apt/lists/*

RUN useradd --create-home frobs
USER frobs
RUN mkdir /home/frobs/frobs && python -m venv /home/frobs/venv
WORKDIR /home/frobs/frobs
ENV PATH=/home/frobs/venv/bin:$PATH PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1

# First, and in a layer of its own. uv selects the build of PyTorch: cpu, or cu130 for a GPU with CUDA 13.0:
#   docker build --build-arg TORCH_BACKEND=cu130 --tag frobs .
ARG TORCH_BACKEND=cpu
RUN pip install uv && uv pip install --python /home/frobs/venv/bin/python --torch-backend ${TORCH_BACKEND} torch==2.13.0

COPY --chown=frobs:frobs pyproject.toml constraints.txt LICENSE CHANGELOG.md ./
COPY --chown=frobs:frobs frobs_core frobs_core/
COPY --chown=frobs:frobs plugins plugins/
COPY --chown=frobs:frobs cookiecutter cookiecutter/
COPY --chown=frobs:frobs templates templates/
RUN pip install --constraint constraints.txt --editable . $(printf ' --editable ./%s' plugins/*/)

CMD ["bash"]
