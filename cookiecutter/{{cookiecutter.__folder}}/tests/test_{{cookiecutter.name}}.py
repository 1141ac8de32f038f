{% if cookiecutter.what in ("simulator", "controller", "algorithm") %}
{{ partial("test_other.py", distribution=cookiecutter.__folder, package=cookiecutter.__package, kinds=cookiecutter.__kinds) -}}
{% endif %}
