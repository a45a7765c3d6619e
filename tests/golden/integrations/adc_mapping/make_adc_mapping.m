function make_adc_mapping()
%MAKE_ADC_MAPPING Builds the S-function sf_adc_mapping for simulation on this machine.
folder = fileparts(mfilename('fullpath'));
sources = {'sf_adc_mapping.c', 'adc_mapping_block.c', 'adc_mapping.c'};
sources = cellfun(@(name) fullfile(folder, name), sources, 'UniformOutput', false);
% -O without -ffast-math: the core refuses to build with it
mex(['-I' folder], '-outdir', folder, '-O', sources{:});
end
