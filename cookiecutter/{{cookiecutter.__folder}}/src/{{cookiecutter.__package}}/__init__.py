{% if cookiecutter.what != "pair" %}
"""{{ partial("summary", kinds=cookiecutter.__kinds)[:1].upper() ~ partial("summary", kinds=cookiecutter.__kinds)[1:] }}."""
{% endif %}
