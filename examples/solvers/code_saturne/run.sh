# The two programs that `code_saturne run` starts: the mesh is read, then solved on. Debian has them beside its library.
export OMP_NUM_THREADS=1
PATH="/usr/lib/code_saturne:/usr/libexec/code_saturne:$PATH"
cs_preprocess bar.msh && cs_solver
