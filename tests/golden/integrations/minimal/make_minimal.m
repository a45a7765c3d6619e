function make_minimal()
%MAKE_MINIMAL Builds the S-function sf_minimal for simulation on this machine.
folder = fileparts(mfilename('fullpath'));
sources = {'sf_minimal.c', 'minimal_block.c', 'minimal.c'};
sources = cellfun(@(name) fullfile(folder, name), sources, 'UniformOutput', false);
% -O without -ffast-math: the core refuses to build with it
mex(['-I' folder], '-outdir', folder, '-O', sources{:});
end
